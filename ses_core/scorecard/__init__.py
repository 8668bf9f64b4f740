"""How representative synthesized environments are, each number beside its real-against-real one."""
