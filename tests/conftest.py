"""Settings of the tests: property-based tests are repeatable and have no clock."""

from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True, print_blob=False)
settings.load_profile("repeatable")
