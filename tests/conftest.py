"""Settings shared by all tests."""

from hypothesis import settings

# The first example of a kernel compiles it, and a shared machine stalls now and then: clocks prove nothing here.
settings.register_profile("steady", deadline=None, derandomize=True)
settings.load_profile("steady")
