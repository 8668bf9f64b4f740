"""From recordings to scenarios to environments (section III-B)."""
