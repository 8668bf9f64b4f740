"""Wiring: which task follows which, and the `ses` command."""
