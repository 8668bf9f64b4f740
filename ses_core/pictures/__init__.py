"""Pictures: arrays in, PNG bytes out (leaf: matplotlib)."""
