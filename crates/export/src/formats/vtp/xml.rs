//! VTK's XML file of poly data, its arrays appended in base64.
//!
//! Not raw: bytes of raw data that look like markup make a file that no XML reader takes.

use std::io::{self, Write};

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;

/// Bytes of the length in front of each array (`header_type`).
const LENGTH: usize = size_of::<u64>();

/// A named array, little endian.
pub(super) struct Array {
    name: &'static str,
    kind: &'static str,
    components: usize,
    /// Names of the components, where they are not the places x, y and z.
    of_components: &'static [&'static str],
    bytes: Vec<u8>,
}

impl Array {
    /// An array of f64, `components` a point or a cell.
    pub(super) fn floats(name: &'static str, components: usize, values: impl Iterator<Item = f64>) -> Self {
        let bytes = values.flat_map(f64::to_le_bytes).collect();
        Self { name, kind: "Float64", components, of_components: &[], bytes }
    }

    /// An array of indices; `usize::MAX` is -1 there.
    pub(super) fn integers(name: &'static str, values: impl Iterator<Item = usize>) -> Self {
        let bytes = values.flat_map(|value| (value as i64).to_le_bytes()).collect();
        Self { name, kind: "Int64", components: 1, of_components: &[], bytes }
    }

    /// The same with names of its components.
    pub(super) fn with_components(self, of_components: &'static [&'static str]) -> Self {
        Self { of_components, ..self }
    }

    /// Characters of the array and its length in base64.
    fn encoded(&self) -> usize {
        4 * (LENGTH + self.bytes.len()).div_ceil(3)
    }
}

/// Lines of two points each, and triangles, with data.
pub(super) struct Piece {
    /// Named lists of texts, data of the whole (VTK: field data).
    pub(super) texts: Vec<(&'static str, Vec<String>)>,
    /// Named numbers, likewise: name, VTK's type and digits.
    pub(super) numbers: Vec<(&'static str, &'static str, String)>,
    /// Places of the points, three components.
    pub(super) points: Array,
    /// Points of each line.
    pub(super) connectivity: Array,
    /// End of each line in `connectivity`.
    pub(super) offsets: Array,
    /// The same two of triangles, if there are any.
    pub(super) triangles: Option<[Array; 2]>,
    pub(super) point_data: Vec<Array>,
    pub(super) cell_data: Vec<Array>,
}

impl Piece {
    /// Writes the file.
    pub(super) fn write(&self, writer: &mut impl Write) -> io::Result<()> {
        let points = self.points.bytes.len() / (3 * size_of::<f64>());
        let cells = self.offsets.bytes.len() / size_of::<i64>();
        let triangles = self.triangles.as_ref().map_or(0, |[_, offsets]| offsets.bytes.len() / size_of::<i64>());
        write!(
            writer,
            "<?xml version=\"1.0\"?>\n\
             <VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
             <PolyData>\n"
        )?;
        self.write_field(writer)?;
        writeln!(
            writer,
            "<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"0\" NumberOfLines=\"{cells}\" \
             NumberOfStrips=\"0\" NumberOfPolys=\"{triangles}\">"
        )?;
        let mut groups: Vec<(&str, Vec<&Array>)> = vec![
            ("PointData", self.point_data.iter().collect()),
            ("CellData", self.cell_data.iter().collect()),
            ("Points", vec![&self.points]),
            ("Lines", vec![&self.connectivity, &self.offsets]),
        ];
        groups.extend(self.triangles.iter().map(|arrays| ("Polys", arrays.iter().collect())));
        let mut offset = 0;
        for (element, arrays) in &groups {
            writeln!(writer, "<{element}>")?;
            for array in arrays {
                let Array { name, kind, components, of_components, .. } = array;
                write!(writer, "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"")?;
                for (k, component) in of_components.iter().enumerate() {
                    write!(writer, " ComponentName{k}=\"{component}\"")?;
                }
                writeln!(writer, " format=\"appended\" offset=\"{offset}\"/>")?;
                offset += array.encoded();
            }
            writeln!(writer, "</{element}>")?;
        }
        write!(writer, "</Piece>\n</PolyData>\n<AppendedData encoding=\"base64\">\n_")?;
        for array in groups.iter().flat_map(|(_, arrays)| arrays) {
            let mut encoder = EncoderWriter::new(&mut *writer, &STANDARD);
            encoder.write_all(&(array.bytes.len() as u64).to_le_bytes())?;
            encoder.write_all(&array.bytes)?;
            encoder.finish()?;
        }
        writeln!(writer, "\n</AppendedData>\n</VTKFile>")
    }

    /// Writes the data of the whole: texts as VTK has them in ASCII, the bytes of each in decimal and a zero after it.
    fn write_field(&self, writer: &mut impl Write) -> io::Result<()> {
        writeln!(writer, "<FieldData>")?;
        for (name, list) in &self.texts {
            let count = list.len();
            write!(writer, "<DataArray type=\"String\" Name=\"{name}\" NumberOfTuples=\"{count}\" format=\"ascii\">")?;
            for byte in list.iter().flat_map(|text| text.bytes().chain([0])) {
                write!(writer, " {byte}")?;
            }
            writeln!(writer, "</DataArray>")?;
        }
        for (name, kind, digits) in &self.numbers {
            let head = format!("type=\"{kind}\" Name=\"{name}\" NumberOfTuples=\"1\"");
            writeln!(writer, "<DataArray {head} format=\"ascii\">{digits}</DataArray>")?;
        }
        writeln!(writer, "</FieldData>")
    }
}
