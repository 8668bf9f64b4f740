"""Worlds to drive in, and the fleet that drives in them."""
