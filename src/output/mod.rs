//! What a run leaves behind: EXR images, false-colour pictures, series, plots and the report.
