"""All tests use one hypothesis profile: the same examples come every time, with no deadlines."""

from hypothesis import HealthCheck, settings

settings.register_profile(
    "pool",
    deadline=None,
    derandomize=True,
    print_blob=False,
    max_examples=100,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("pool")
