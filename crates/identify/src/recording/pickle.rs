//! Python's pickles, as far as numbers in lists and numpy's arrays go: protocols 2 to 5, no code of theirs is run.
//!
//! A pickle is a program for a small machine with a stack (Python's `pickletools` documents its operations). Names of functions
//! and classes stay names here: what is known of numpy becomes numbers, and all else is an error.

use super::grid::{Grid, elements};

/// A value on the machine's stack.
#[derive(Clone, Debug)]
enum Value {
    Nothing,
    Number(f64),
    Text(String),
    Bytes(Vec<u8>),
    List(Vec<Value>),
    /// A function or class by its last name.
    Name(String),
    /// A type of numpy's elements, such as "f8" or "i4", and whether its bytes come most significant first.
    Type(String, bool),
    Array(Grid),
    Mark,
}

/// Most lists within lists; recordings have three or four.
const DEEPEST: usize = 8;
const TOO_DEEP: &str = "lists within lists that are too deep";

impl Value {
    /// How many lists stand within each other.
    fn depth(&self) -> usize {
        match self {
            Value::List(values) => 1 + values.iter().map(Value::depth).max().unwrap_or(0),
            _ => 0,
        }
    }
}

/// A list of these values.
fn listed(values: Vec<Value>) -> Result<Value, String> {
    let list = Value::List(values);
    if list.depth() > DEEPEST { Err(TOO_DEEP.into()) } else { Ok(list) }
}

/// Reads the grid of numbers that `bytes` hold: nested lists, numpy's arrays and scalars.
///
/// # Errors
/// What is not understood, and at which byte.
pub(super) fn read(bytes: &[u8]) -> Result<Grid, String> {
    let mut machine = Machine { bytes, at: 0, stack: Vec::new(), memo: Vec::new() };
    let value = machine.run().map_err(|message| format!("no pickle of numbers: byte {}: {message}", machine.at))?;
    let mut grid = Grid::default();
    flatten(&value, 0, &mut grid)?;
    Grid::new(grid.shape, grid.values)
}

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    stack: Vec<Value>,
    memo: Vec<Option<Value>>,
}

impl<'a> Machine<'a> {
    fn run(&mut self) -> Result<Value, String> {
        loop {
            let operation = self.take(1)?[0];
            let pushed = match operation {
                // The protocol and the frames say nothing of the value.
                0x80 => {
                    self.take(1)?;
                    continue;
                }
                0x95 => {
                    self.take(8)?;
                    continue;
                }
                b'.' => return self.pop(),
                b'(' => Value::Mark,
                b']' | b')' => Value::List(Vec::new()),
                b'N' => Value::Nothing,
                0x88 => Value::Number(1.0),
                0x89 => Value::Number(0.0),
                b'K' => Value::Number(self.size(1)? as f64),
                b'M' => Value::Number(self.size(2)? as f64),
                b'J' => Value::Number(f64::from(i32::from_le_bytes(self.array()?))),
                b'G' => Value::Number(f64::from_be_bytes(self.array()?)),
                0x8c => self.text(1)?,
                b'X' => self.text(4)?,
                b'C' => self.raw(1)?,
                b'B' => self.raw(4)?,
                0x8e => self.raw(8)?,
                0x94 => {
                    self.remember(self.memo.len())?;
                    continue;
                }
                b'q' | b'r' => {
                    let index = self.size(if operation == b'q' { 1 } else { 4 })?;
                    self.remember(index)?;
                    continue;
                }
                b'h' | b'j' => {
                    let index = self.size(if operation == b'h' { 1 } else { 4 })?;
                    self.memo.get(index).cloned().flatten().ok_or("something that was never remembered")?
                }
                b'c' => {
                    self.line()?;
                    Value::Name(self.line()?)
                }
                0x93 => match (self.pop()?, self.pop()?) {
                    (Value::Text(name), _) => Value::Name(name),
                    _ => return Err("a name that is no text".into()),
                },
                b'a' | b'e' => {
                    let values = if operation == b'a' { vec![self.pop()?] } else { self.since_mark()? };
                    if values.iter().any(|value| value.depth() >= DEEPEST) {
                        return Err(TOO_DEEP.into());
                    }
                    let Some(Value::List(list)) = self.stack.last_mut() else {
                        return Err("something is added to what is no list".into());
                    };
                    list.extend(values);
                    continue;
                }
                b't' | b'l' => listed(self.since_mark()?)?,
                0x85..=0x87 => {
                    let first = self.stack.len().checked_sub(usize::from(operation - 0x84)).ok_or("an empty stack")?;
                    listed(self.stack.split_off(first))?
                }
                b'R' => self.call()?,
                b'b' => self.build()?,
                operation => return Err(format!("operation 0x{operation:02x} makes no numbers")),
            };
            self.stack.push(pushed);
        }
    }

    /// Calls what numpy's pickles call.
    fn call(&mut self) -> Result<Value, String> {
        let (Value::List(arguments), Value::Name(name)) = (self.pop()?, self.pop()?) else {
            return Err("a call of what is no function".into());
        };
        match (name.as_str(), arguments.as_slice()) {
            ("dtype", [Value::Text(name), ..]) => {
                Ok(Value::Type(name.trim_start_matches(['<', '|', '=']).into(), false))
            }
            ("_reconstruct", _) => Ok(Value::Array(Grid::default())),
            ("scalar", [Value::Type(name, big), Value::Bytes(bytes)]) => match elements(name, *big, bytes)?[..] {
                [value] => Ok(Value::Number(value)),
                _ => Err("a scalar of several numbers".into()),
            },
            _ => Err(format!("a call of {name}, which is unknown")),
        }
    }

    /// Fills what a call has made: an array, or the order of a type's bytes.
    fn build(&mut self) -> Result<Value, String> {
        let (Value::List(state), built) = (self.pop()?, self.pop()?) else {
            return Err("a state that is no tuple".into());
        };
        match (built, state.as_slice()) {
            (Value::Type(name, _), [_, Value::Text(order), ..]) => {
                let made = Value::Type(name, order == ">");
                // It was remembered before it was filled, as the last of its kind, and will be asked for again.
                let is_type = |value: &&mut Option<Value>| matches!(value, Some(Value::Type(..)));
                if let Some(place) = self.memo.iter_mut().rev().find(is_type) {
                    *place = Some(made.clone());
                }
                Ok(made)
            }
            (
                Value::Array(_),
                [_, Value::List(shape), Value::Type(name, big), Value::Number(fortran), Value::Bytes(bytes)],
            ) => {
                let size = |value: &Value| match value {
                    Value::Number(size) => Ok(*size as usize),
                    _ => Err("a shape without numbers".to_owned()),
                };
                let shape = shape.iter().map(size).collect::<Result<Vec<_>, _>>()?;
                let grid = Grid::new(shape, elements(name, *big, bytes)?)?;
                Ok(Value::Array(if *fortran == 0.0 { grid } else { grid.first_axis_fastest() }))
            }
            _ => Err("a state of something unknown".into()),
        }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.bytes.len()).ok_or("the file ends here")?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// A whole number of so many bytes, the least significant first.
    fn size(&mut self, bytes: usize) -> Result<usize, String> {
        let size = self.take(bytes)?.iter().rev().fold(0u64, |size, &byte| size << 8 | u64::from(byte));
        usize::try_from(size).map_err(|_| "a size beyond the memory".to_owned())
    }

    fn text(&mut self, bytes: usize) -> Result<Value, String> {
        let size = self.size(bytes)?;
        let text = String::from_utf8(self.take(size)?.to_vec()).map_err(|_| "a text that is not UTF-8")?;
        Ok(Value::Text(text))
    }

    fn raw(&mut self, bytes: usize) -> Result<Value, String> {
        let size = self.size(bytes)?;
        Ok(Value::Bytes(self.take(size)?.to_vec()))
    }

    fn line(&mut self) -> Result<String, String> {
        let length = self.bytes[self.at..].iter().position(|&byte| byte == b'\n').ok_or("a line without an end")?;
        Ok(String::from_utf8_lossy(self.take(length + 1)?).trim_end().to_owned())
    }

    fn pop(&mut self) -> Result<Value, String> {
        self.stack.pop().ok_or_else(|| "an empty stack".to_owned())
    }

    fn since_mark(&mut self) -> Result<Vec<Value>, String> {
        let mark = self.stack.iter().rposition(|value| matches!(value, Value::Mark)).ok_or("no mark")?;
        let values = self.stack.split_off(mark + 1);
        self.stack.pop();
        Ok(values)
    }

    /// Remembers the top of the stack. Arrays are never asked for again, and lists while they are empty.
    fn remember(&mut self, index: usize) -> Result<(), String> {
        let top = self.stack.last().ok_or("an empty stack")?;
        let kept = if let Value::Array(_) = top { Value::Nothing } else { top.clone() };
        if index > self.bytes.len() {
            return Err("a place beyond the file".into());
        }
        if index >= self.memo.len() {
            self.memo.resize(index + 1, None);
        }
        self.memo[index] = Some(kept);
        Ok(())
    }
}

/// Appends the numbers of `value`, which stands `depth` lists deep, to `grid`, all of whose lists must be alike.
fn flatten(value: &Value, depth: usize, grid: &mut Grid) -> Result<(), String> {
    match value {
        Value::Number(number) if depth == grid.shape.len() => {
            grid.values.push(*number);
            Ok(())
        }
        Value::Number(_) => Err("lists of different depths".into()),
        Value::List(list) => {
            grid.expect(depth, list.len())?;
            list.iter().try_for_each(|value| flatten(value, depth + 1, grid))
        }
        Value::Array(array) => {
            for (axis, &size) in array.shape.iter().enumerate() {
                grid.expect(depth + axis, size)?;
            }
            grid.values.extend(&array.values);
            Ok(())
        }
        _ => Err("something that is no number, list or array".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_are_grids() {
        // pickle.dumps([[1.5, 2], [-3, 4.0]], 4)
        let bytes = b"\x80\x04\x95\x24\0\0\0\0\0\0\0]\x94(]\x94(G?\xf8\0\0\0\0\0\0K\x02e]\x94(J\xfd\xff\xff\xffG@\x10\0\0\0\0\0\0ee.";
        assert_eq!(read(bytes), Grid::new(vec![2, 2], vec![1.5, 2.0, -3.0, 4.0]));
        for cut in 0..bytes.len() {
            assert!(read(&bytes[..cut]).unwrap_err().contains("byte"));
        }
    }

    #[test]
    fn numpys_arrays_are_grids() {
        // numpy.array([[1.0, 2.0]]), in the operations of protocol 3.
        let mut bytes = b"\x80\x03cnumpy.core.multiarray\n_reconstruct\nq\0cnumpy\nndarray\nq\x01K\0\x85q\x02C\x01b\x87q\x03Rq\x04\
            (K\x01K\x01K\x02\x86q\x05cnumpy\ndtype\nq\x06X\x02\0\0\0f8K\0K\x01\x87q\x07Rq\x08(K\x03X\x01\0\0\0<NNNJ\xff\xff\xff\xff\
            J\xff\xff\xff\xffK\0tq\x09b\x89C\x10"
            .to_vec();
        bytes.extend([1.0f64, 2.0].into_iter().flat_map(f64::to_le_bytes));
        bytes.extend(b"tb.");
        assert_eq!(read(&bytes), Grid::new(vec![1, 2], vec![1.0, 2.0]));
    }

    #[test]
    fn what_is_no_grid_is_refused() {
        for (bytes, reason) in [
            (b"\x80\x04]\x94(K\x01]\x94e." as &[u8], "depths"),
            (b"\x80\x04cos\nsystem\n\x8c\x02ls\x85R.", "system"),
            (b"\x80\x04]\x94(]\x94K\x01a]\x94(K\x01K\x02ee.", "lengths"),
            (b"hello", "byte"),
            // A list of arrays, of (1, 1) and of (1).
            (b"\x80\x04]\x94(]\x94]\x94K\x01aa]\x94K\x01ae.", "depths"),
            (&[&b"K\x01"[..], &[0x85; 100_000], b"."].concat(), "too deep"),
        ] {
            let error = read(bytes).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
    }
}
