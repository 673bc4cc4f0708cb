"""Records on the disk: what is read is what was written, bit for bit, or it is said to be damaged."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roughvisc.study.records import Damaged, read_record, write_record


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
