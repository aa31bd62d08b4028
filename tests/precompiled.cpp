// Nothing: its target is there for the headers that it precompiles.
