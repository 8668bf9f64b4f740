"""Paired trials and what they prove."""
