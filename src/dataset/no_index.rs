//! In place of the index of a data set, where isotherm is built without Parquet: it is refused.

use std::fs::File;

use serde_json::{Map, Value as Json};

use crate::output::OutputError;

const ABSENT: &str = "isotherm was built without the feature 'datasets'";

pub(crate) fn encode(_: &[Map<String, Json>]) -> Result<Vec<u8>, OutputError> {
    Err(OutputError::Encode("Parquet index".to_owned(), ABSENT.to_owned()))
}

pub(crate) fn rows_in(_: File) -> Result<usize, String> {
    Err(ABSENT.to_owned())
}
