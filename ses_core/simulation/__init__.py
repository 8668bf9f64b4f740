"""Simulated robots: the compiled batch and the rigid-body one."""
