"""From many challenging environments to a representative few (section III-C)."""
