"""A data set made by a local Ray cluster that loses a worker."""
