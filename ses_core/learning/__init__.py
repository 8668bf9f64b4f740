"""Learning to set planner parameters (APPLR)."""
