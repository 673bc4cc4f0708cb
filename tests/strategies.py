"""What properties are drawn from: grids, surfaces, materials. And how many examples of them, in one place.

The default suite draws the same examples in each run, so that a change is judged by what it changes.
``pytest --hypothesis-profile=thorough`` draws ten times as many, others each time.
"""

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

import roughvisc as rv

# no deadline: it would be an assertion about the time of the clock
settings.register_profile("suite", deadline=None, max_examples=100, derandomize=True)
settings.register_profile("thorough", settings.get_profile("suite"), max_examples=1000, derandomize=False)
settings.load_profile("suite")


def examples(count, **options):
    """So many examples, of a hundred that the profile draws by default."""
    return settings(max_examples=max(1, count * settings().max_examples // 100), **options)


#: A few examples, always the same: of properties whose example is several whole runs.
of_whole_runs = examples(8, derandomize=True, suppress_health_check=[HealthCheck.too_slow])

# ----------------------------------------------------------------------------------------------------------------
# numbers

positive = st.floats(1e-6, 1e6)
#: From a hundredth to a hundred, evenly in the logarithm.
decades = st.floats(-2, 2).map(lambda exponent: 10.0**exponent)
seeds = st.integers(0, 2**32 - 1)

# ----------------------------------------------------------------------------------------------------------------
# grids and surfaces

boundaries = st.sampled_from(["free", "periodic"])


def shapes(least, most):
    """Cells along x and y, odd and even, mostly unequal."""
    return st.tuples(st.integers(least, most), st.integers(least, most))


@st.composite
def surfaces(draw):
    """Small rough surfaces, one metre wide."""
    return rv.self_affine(1.0, draw(shapes(5, 17)), hurst=0.7, rms_slope=0.1, seed=draw(seeds))


# ----------------------------------------------------------------------------------------------------------------
# materials


@st.composite
def series(draw, glassy, compliances, times, fluidities=(0.0,), least=0, most=3):
    """Series of so many exponentials, with or without flow."""
    branches = draw(st.lists(st.tuples(compliances, times), min_size=least, max_size=most))
    fluidity = draw(st.one_of(*(one if isinstance(one, st.SearchStrategy) else st.just(one) for one in fluidities)))
    return rv.Prony(draw(glassy), fluidity, tuple(c for c, _ in branches), tuple(t for _, t in branches))


#: Two exponentials whose times may be those of another one; Poisson's ratio too.
series_with_common_times = st.builds(
    rv.Prony,
    st.floats(0.01, 10),
    st.sampled_from([0.0, 0.3]),
    st.just((1.0, 2.0)),
    st.tuples(st.sampled_from([0.1, 1.0]), st.floats(2, 10)),
    st.floats(-0.9, 0.5),
)


@st.composite
def stiffened(draw):
    """Functions of a factor: a material that can jump, of so many times the stiffness."""
    glassy, late, time = draw(decades), draw(decades), draw(decades)
    kind = draw(st.sampled_from(["elastic", "maxwell", "zener", "power law"]))
    return {
        "elastic": lambda s: rv.Prony(glassy / s),
        "maxwell": lambda s: rv.Prony(glassy / s, fluidity=glassy / time / s),
        "zener": lambda s: rv.Prony(glassy / s, 0.0, (late / s,), (time,)),
        "power law": lambda s: rv.power_law(glassy / s, late / s, 0.4, time),
    }[kind]
