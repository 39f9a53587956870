"""A data set made in several ways, of which each must give the same files."""
