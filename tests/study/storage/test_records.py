"""Records on the disk: what is read is what was written, bit for bit, or it is said to be damaged."""

import errno
import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roughvisc.study.storage import checkpoint as records
from roughvisc.study.storage.checkpoint import Damaged, RowFile, read_record, write_record


def field(share, seed, shape=(37, 41)):
    """So large a share of the cells holds numbers, among them every special one."""
    draw = np.random.default_rng(seed)
    values = np.where(draw.random(shape) < share, draw.normal(size=shape), 0.0)
    values.flat[:6] = [-0.0, np.nan, np.inf, -np.inf, 5e-324, 0.0]
    return values


@given(share=st.sampled_from([0.0, 0.05, 0.24, 0.3, 1.0]), seed=st.integers(0, 99))
def test_record__comes_back_bit_for_bit(share, seed):
    arrays = {"p": field(share, seed), "n": np.arange(7), "empty": np.empty((0, 3)), "flags": np.eye(3, dtype=bool)}
    stream = io.BytesIO()
    size = write_record(stream, {"time": 0.1}, arrays)
    assert size == stream.tell()
    stream.seek(0)
    plain, read = read_record(stream)
    assert plain == {"time": 0.1}
    for name, array in arrays.items():
        assert read[name].dtype == array.dtype
        assert read[name].shape == array.shape
        assert read[name].tobytes() == array.tobytes(), name
    assert stream.tell() == size


def test_record__of_a_mostly_empty_field_is_small():
    sparse, dense = io.BytesIO(), io.BytesIO()
    write_record(sparse, {}, {"p": field(0.05, 1)})
    write_record(dense, {}, {"p": field(1.0, 1)})
    assert sparse.tell() < 0.1 * dense.tell()


@pytest.mark.parametrize("share", [0.05, 1.0])
def test_record__that_is_torn_or_changed_is_damaged(share):
    stream = io.BytesIO()
    size = write_record(stream, {}, {"p": field(share, 1)})
    whole = stream.getvalue()
    for bad in (whole[: size - 1], whole[:10], whole[:-9] + b"\x01" + whole[-8:], b"xxxx" + whole[4:]):
        with pytest.raises(Damaged):
            read_record(io.BytesIO(bad))


def test_waiting_rows__are_weighed_once_each(tmp_path):
    """A run may keep any number of rows without fields between two checkpoints."""
    weighed = 0

    class Fields(dict):
        def values(self):
            nonlocal weighed
            weighed += 1
            return super().values()

    rows = RowFile(tmp_path / "rows")
    for number in range(50):
        rows.append({"row": number}, Fields())
    assert weighed == 50
    rows.close()


def test_waiting_rows__that_do_not_fit_wait_on(tmp_path, monkeypatch):
    written = []

    def write(stream, plain, arrays):
        if plain["row"] == 2 and len(written) == 2:
            written.append("full")
            raise OSError(errno.ENOSPC, "No space left on device")
        written.append(plain["row"])
        return write_record(stream, plain, arrays)

    monkeypatch.setattr(records, "write_record", write)
    rows = RowFile(tmp_path / "rows")
    fields = [{"p": field(1.0, number)} for number in range(4)]
    for number, arrays in enumerate(fields):
        rows.append({"row": number}, arrays)
    with pytest.raises(OSError, match="No space left"):
        rows.sync()
    rows.sync()
    assert written == [0, 1, "full", 2, 3]
    for number, arrays in enumerate(fields):
        assert rows.arrays(number, "p")["p"].tobytes() == arrays["p"].tobytes()
    rows.close()
