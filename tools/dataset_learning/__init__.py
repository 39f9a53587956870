"""A smoke test that the images and the labels of a data set agree: a small network learns one from the other."""
