"""Tests, in the shape of the floors."""
