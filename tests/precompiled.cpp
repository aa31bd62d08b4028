// This file is empty. Its target exists for the headers that it precompiles.
