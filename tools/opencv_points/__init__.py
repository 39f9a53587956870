"""Points in Isotherm's images beside those of OpenCV (tools/opencv_check)."""
