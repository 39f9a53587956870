//! The index of a data set: a Parquet file with a row for each image.

use std::fs::File;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use serde_json::{Map, Value as Json};

use crate::output::OutputError;

/// Rows of a group.
const GROUP: usize = 65_536;

/// A column by its name and type.
#[derive(Debug, Clone, PartialEq, Eq)]
struct IndexColumn {
    name: String,
    physical: Physical,
}

/// The file. The columns of the first row come first, and further columns of other rows follow in the order of their names. A value that a row lacks
/// is null.
///
/// # Errors
/// A table that can not be encoded.
pub(crate) fn encode(rows: &[Map<String, Json>]) -> Result<Vec<u8>, OutputError> {
    let failed = |error: ParquetError| OutputError::Encode("Parquet index".to_owned(), error.to_string());
    let columns = columns(rows);
    let fields = columns.iter().map(|column| {
        let logical = (column.physical == Physical::BYTE_ARRAY).then_some(LogicalType::String);
        let field = Type::primitive_type_builder(&column.name, column.physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical);
        field.build().map(Arc::new)
    });
    let fields = fields.collect::<Result<Vec<_>, _>>().map_err(failed)?;
    let schema = Type::group_type_builder("image").with_fields(fields).build().map_err(failed)?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::UNCOMPRESSED)
        .set_created_by(format!("isotherm {}", env!("CARGO_PKG_VERSION")))
        .build();
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(properties)).map_err(failed)?;
    for group in rows.chunks(GROUP) {
        let mut rows = file.next_row_group().map_err(failed)?;
        for column in &columns {
            let Some(mut writer) = rows.next_column().map_err(failed)? else { continue };
            let values = || group.iter().map(|row| row.get(&column.name).filter(|value| !value.is_null()));
            let levels: Vec<i16> = values().map(|value| i16::from(value.is_some())).collect();
            match writer.untyped() {
                ColumnWriter::Int64ColumnWriter(typed) => {
                    let all: Vec<i64> = values().flatten().map(|value| value.as_i64().unwrap_or_default()).collect();
                    typed.write_batch(&all, Some(&levels), None)
                }
                ColumnWriter::DoubleColumnWriter(typed) => {
                    let all: Vec<f64> = values().flatten().map(|value| value.as_f64().unwrap_or(f64::NAN)).collect();
                    typed.write_batch(&all, Some(&levels), None)
                }
                ColumnWriter::ByteArrayColumnWriter(typed) => {
                    let text = |value: &Json| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                    let all: Vec<ByteArray> =
                        values().flatten().map(|value| ByteArray::from(text(value).as_str())).collect();
                    typed.write_batch(&all, Some(&levels), None)
                }
                _ => Ok(0),
            }
            .map_err(failed)?;
            writer.close().map_err(failed)?;
        }
        rows.close().map_err(failed)?;
    }
    file.close().map_err(failed)?;
    Ok(bytes)
}

/// Number of the rows of a file.
///
/// # Errors
/// It is no Parquet file.
pub(crate) fn rows_in(file: File) -> Result<usize, String> {
    let reader = SerializedFileReader::new(file).map_err(|error| error.to_string())?;
    Ok(reader.metadata().file_metadata().num_rows() as usize)
}

/// The columns of some rows. One whose numbers are all whole holds whole numbers.
fn columns(rows: &[Map<String, Json>]) -> Vec<IndexColumn> {
    let mut names: Vec<&String> = rows.first().map(|row| row.keys().collect()).unwrap_or_default();
    let known: std::collections::HashSet<&String> = names.iter().copied().collect();
    let more: std::collections::BTreeSet<&String> =
        rows.iter().flat_map(Map::keys).filter(|name| !known.contains(name)).collect();
    names.extend(more);
    let physical = |name: &String| {
        let kind = |value: &Json| match value {
            Json::Number(number) if number.is_i64() || number.is_u64() => Some(Physical::INT64),
            Json::Number(_) => Some(Physical::DOUBLE),
            Json::Null => None,
            _ => Some(Physical::BYTE_ARRAY),
        };
        rows.iter().filter_map(|row| kind(row.get(name)?)).fold(Physical::INT64, |all, one| match (all, one) {
            (Physical::BYTE_ARRAY, _) | (_, Physical::BYTE_ARRAY) => Physical::BYTE_ARRAY,
            (Physical::DOUBLE, _) | (_, Physical::DOUBLE) => Physical::DOUBLE,
            _ => Physical::INT64,
        })
    };
    names.into_iter().map(|name| IndexColumn { name: name.clone(), physical: physical(name) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn rows_come_back_with_their_types() {
        let row = |value: Json| value.as_object().unwrap().clone();
        let rows = vec![
            row(json!({"sample": 0, "x": 1, "name": "a"})),
            row(json!({"sample": 1, "x": 0.5, "name": null, "late": 3})),
        ];
        let bytes = encode(&rows).unwrap();
        assert_eq!(bytes, encode(&rows).unwrap());
        let file = |bytes: &[u8]| {
            let mut file = tempfile::tempfile().unwrap();
            std::io::Write::write_all(&mut file, bytes).unwrap();
            file
        };
        assert_eq!(rows_in(file(&bytes)), Ok(2));
        assert!(rows_in(file(&bytes[..bytes.len() - 1])).is_err());
        let reader = SerializedFileReader::new(file(&bytes)).unwrap();
        let computed: Vec<String> = reader.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()).collect();
        assert_eq!(computed[0], "{sample: 0, x: 1.0, name: \"a\", late: null}");
        assert_eq!(computed[1], "{sample: 1, x: 0.5, name: null, late: 3}");
    }
}
