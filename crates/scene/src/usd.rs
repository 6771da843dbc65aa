//! Curves in OpenUSD files as text: the points of a linear `BasisCurves` prim, in metres with z up.
//!
//! Of the text format all is passed over that is no curve and no transform above one. A value that changes over time is read at its
//! first time sample.

use std::iter::Peekable;
use std::str::Chars;

use nalgebra::{Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::error::{Mistake, Result, mistaken};

/// First characters of a file as text, and of a binary one.
pub(crate) const TEXT: &str = "#usda";
pub(crate) const BINARY: &[u8] = b"PXR-USDC";
/// What is said of the latter.
pub(crate) const NO_BINARY: &str =
    "this is a binary USD file; save it as text, as `usdcat` does with -o and a name in .usda";

/// Levels of brackets in a value, and of prims, that are read.
const DEEPEST_VALUE: usize = 8;
const DEEPEST_PRIM: usize = 100;

/// Which curve of a file is wanted.
#[derive(Clone, Copy)]
pub(crate) struct Wanted<'a> {
    /// Path of its prim; `None` for the only one.
    pub(crate) prim: Option<&'a str>,
    /// Which of the prim's curves; `None` for the only one.
    pub(crate) curve: Option<usize>,
    pub(crate) closed: bool,
}

/// The points of the wanted curve in a file's text [m]; `file` stands in errors.
pub(crate) fn read(text: &str, file: &str, wanted: Wanted<'_>) -> Result<Vec<Vector3<f64>>> {
    Layer::parse(text).and_then(|layer| layer.points(wanted)).map_err(|mistake| mistaken(file, mistake))
}

/// A token and its line.
#[derive(Clone, Debug, PartialEq)]
enum Token {
    /// A name, a number, a path, an asset.
    Word(String),
    Text(String),
    Sign(char),
    End,
}

struct Tokens<'a> {
    chars: Peekable<Chars<'a>>,
    line: usize,
    /// The next token, and its line.
    next: (usize, Token),
}

impl<'a> Tokens<'a> {
    fn new(text: &'a str) -> std::result::Result<Self, Mistake> {
        let mut tokens = Self { chars: text.chars().peekable(), line: 1, next: (1, Token::End) };
        tokens.take()?;
        Ok(tokens)
    }

    fn char(&mut self) -> Option<char> {
        let c = self.chars.next();
        self.line += usize::from(c == Some('\n'));
        c
    }

    /// The next token, which is passed.
    fn take(&mut self) -> std::result::Result<Token, Mistake> {
        while let Some(&c) = self.chars.peek() {
            match c {
                '#' => {
                    while self.chars.peek().is_some_and(|&c| c != '\n') {
                        self.char();
                    }
                }
                c if c.is_whitespace() || c == ';' => drop(self.char()),
                _ => break,
            }
        }
        let line = self.line;
        let token = match self.char() {
            None => Token::End,
            Some(quote @ ('"' | '\'')) => Token::Text(self.text(quote)?),
            Some('<') => Token::Word(self.until('>')?),
            Some('@') => Token::Word(self.until('@')?),
            Some(c @ ('=' | '(' | ')' | '[' | ']' | '{' | '}' | ',')) => Token::Sign(c),
            Some(c) => {
                let mut word = String::from(c);
                let ends = |c: char| c.is_whitespace() || "=()[]{},;#\"'<@".contains(c);
                while let Some(&c) = self.chars.peek().filter(|&&c| !ends(c)) {
                    word.push(c);
                    self.char();
                }
                Token::Word(word)
            }
        };
        Ok(std::mem::replace(&mut self.next, (line, token)).1)
    }

    fn until(&mut self, end: char) -> std::result::Result<String, Mistake> {
        let (line, mut word) = (self.line, String::new());
        loop {
            match self.char() {
                Some(c) if c == end => return Ok(word),
                Some(c) => word.push(c),
                None => return Err((line, format!("this is not closed by `{end}`"))),
            }
        }
    }

    /// A text after its first quotation mark; three of these enclose lines.
    fn text(&mut self, quote: char) -> std::result::Result<String, Mistake> {
        let line = self.line;
        let mut text = self.quoted(quote, line)?;
        if text.is_empty() && self.chars.peek() == Some(&quote) {
            self.char();
            loop {
                text += &self.quoted(quote, line)?;
                if self.chars.peek() == Some(&quote) {
                    self.char();
                    if self.chars.peek() == Some(&quote) {
                        self.char();
                        return Ok(text);
                    }
                    text.push(quote);
                }
                text.push(quote);
            }
        }
        Ok(text)
    }

    fn quoted(&mut self, quote: char, line: usize) -> std::result::Result<String, Mistake> {
        let mut text = String::new();
        loop {
            match self.char() {
                Some(c) if c == quote => return Ok(text),
                Some('\\') => text.extend(self.char()),
                Some(c) => text.push(c),
                None => return Err((line, "this text is not closed".to_owned())),
            }
        }
    }

    fn is(&self, sign: char) -> bool {
        self.next.1 == Token::Sign(sign)
    }

    fn expect(&mut self, sign: char) -> std::result::Result<(), Mistake> {
        let line = self.next.0;
        match self.take()? {
            Token::Sign(found) if found == sign => Ok(()),
            found => Err((line, format!("`{sign}` must stand here, not {}", named(&found)))),
        }
    }

    /// Passes what brackets enclose, which are next.
    fn skip(&mut self) -> std::result::Result<(), Mistake> {
        let (line, mut depth) = (self.next.0, 0);
        loop {
            match self.take()? {
                Token::Sign('(' | '[' | '{') => depth += 1,
                Token::Sign(')' | ']' | '}') => depth -= 1,
                Token::End => return Err((line, "this bracket is not closed".to_owned())),
                _ => {}
            }
            if depth == 0 {
                return Ok(());
            }
        }
    }
}

fn named(token: &Token) -> String {
    match token {
        Token::Word(word) => format!("`{word}`"),
        Token::Text(text) => format!("\"{text}\""),
        Token::Sign(sign) => format!("`{sign}`"),
        Token::End => "the end of the file".to_owned(),
    }
}

/// A value, as far as it matters here.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    Number(f64),
    Text(String),
    /// An array or a tuple.
    List(Vec<Value>),
}

impl Value {
    fn numbers<const N: usize>(&self) -> Option<[f64; N]> {
        let Value::List(values) = self else { return None };
        let numbers: Vec<f64> = values.iter().filter_map(Value::number).collect();
        (numbers.len() == values.len()).then_some(numbers)?.try_into().ok()
    }

    fn number(&self) -> Option<f64> {
        if let Value::Number(number) = self { Some(*number) } else { None }
    }
}

/// An attribute and its line.
struct Attribute {
    line: usize,
    name: String,
    value: Value,
}

/// A prim that has curves.
struct Curves {
    line: usize,
    path: String,
    attributes: Vec<Attribute>,
    /// From its own axes to those of the file.
    place: Matrix4<f64>,
}

#[derive(Default)]
struct Layer {
    curves: Vec<Curves>,
    /// Metres a unit, and the axis that points up.
    metres: Option<f64>,
    up: Option<String>,
}

impl Layer {
    fn parse(text: &str) -> std::result::Result<Self, Mistake> {
        let mut tokens = Tokens::new(text)?;
        let mut layer = Self::default();
        if tokens.is('(') {
            tokens.take()?;
            while !tokens.is(')') {
                if matches!(tokens.next.1, Token::Text(_)) {
                    tokens.take()?;
                    continue;
                }
                if tokens.next.1 == Token::End {
                    return Err((tokens.next.0, "a `)` is missing at the end of the file".to_owned()));
                }
                let Some(Attribute { line, name, value }) = attribute(&mut tokens)? else { continue };
                match (name.as_str(), value) {
                    ("metersPerUnit", Value::Number(metres)) if metres > 0.0 && metres.is_finite() => {
                        layer.metres = Some(metres);
                    }
                    ("upAxis", Value::Text(axis)) if axis == "Y" || axis == "Z" => layer.up = Some(axis),
                    (key @ ("metersPerUnit" | "upAxis"), _) => {
                        let allowed = if key == "upAxis" { "\"Y\" or \"Z\"" } else { "> 0" };
                        return Err((line, format!("{key} must be {allowed}")));
                    }
                    _ => {}
                }
            }
            tokens.take()?;
        }
        while tokens.next.1 != Token::End {
            layer.prim(&mut tokens, "")?;
        }
        Ok(layer)
    }

    /// Reads what is next below a prim: another prim; all else is passed.
    fn prim(&mut self, tokens: &mut Tokens<'_>, above: &str) -> std::result::Result<(), Mistake> {
        let line = tokens.next.0;
        if above.matches("/").count() > DEEPEST_PRIM {
            return Err((line, "prims are nested too deeply".to_owned()));
        }
        tokens.take()?;
        let (kind, name) = match tokens.take()? {
            Token::Word(kind) => {
                let Token::Text(name) = tokens.take()? else {
                    return Err((line, "a prim must have a name".to_owned()));
                };
                (kind, name)
            }
            Token::Text(name) => (String::new(), name),
            found => return Err((line, format!("a prim must have a name, not {}", named(&found)))),
        };
        let path = format!("{above}/{name}");
        if tokens.is('(') {
            tokens.skip()?;
        }
        tokens.expect('{')?;
        // What a prim's transform is stands anywhere among its attributes, and its children may come first: these are placed in it when
        // all of it has been read.
        let first = self.curves.len();
        let attributes = body(tokens, |tokens| self.prim(tokens, &path))?;
        let place = transform(&attributes)?;
        for below in &mut self.curves[first..] {
            below.place = place * below.place;
        }
        if kind == "BasisCurves" {
            self.curves.push(Curves { line, path, attributes, place });
        }
        Ok(())
    }

    fn points(self, wanted: Wanted<'_>) -> std::result::Result<Vec<Vector3<f64>>, Mistake> {
        let all = || self.curves.iter().map(|curves| curves.path.as_str()).collect::<Vec<_>>().join(", ");
        let curves = match (wanted.prim, &self.curves[..]) {
            (_, []) => return Err((1, "there is no prim of type BasisCurves".to_owned())),
            (None, [only]) => only,
            (None, _) => return Err((1, format!("there are several curves, name one with `prim`: {}", all()))),
            (Some(path), several) => match several.iter().find(|curves| curves.path == path) {
                Some(curves) => curves,
                None => return Err((1, format!("there are no curves at {path}; there are {}", all()))),
            },
        };
        let (metres, up) = (self.metres.unwrap_or(0.01), self.up.as_deref().unwrap_or("Y"));
        let place = |own: Vector3<f64>| {
            let x = curves.place.transform_point(&own.into()).coords * metres;
            if up == "Y" { Vector3::new(x.x, -x.z, x.y) } else { x }
        };
        Ok(curves.own(wanted)?.into_iter().map(place).collect())
    }
}

/// Reads the attributes of a prim up to its closing brace; what begins a prim or a set of variants is left to `child`.
fn body(
    tokens: &mut Tokens<'_>,
    mut child: impl FnMut(&mut Tokens<'_>) -> std::result::Result<(), Mistake>,
) -> std::result::Result<Vec<Attribute>, Mistake> {
    let mut attributes = Vec::new();
    loop {
        match &tokens.next {
            (_, Token::Sign('}')) => {
                tokens.take()?;
                return Ok(attributes);
            }
            (line, Token::End) => return Err((*line, "a `}` is missing at the end of the file".to_owned())),
            (_, Token::Word(word)) if ["def", "over", "class"].contains(&word.as_str()) => child(tokens)?,
            (_, Token::Word(word)) if word == "variantSet" => {
                while !tokens.is('{') && tokens.next.1 != Token::End {
                    tokens.take()?;
                }
                tokens.skip()?;
            }
            _ => attributes.extend(attribute(tokens)?),
        }
    }
}

/// Reads a declaration: type and name, a value if it has one, and what stands in brackets after it.
fn attribute(tokens: &mut Tokens<'_>) -> std::result::Result<Option<Attribute>, Mistake> {
    let line = tokens.next.0;
    let mut name = String::new();
    while tokens.next.0 == line && !tokens.is('=') && !tokens.is('(') && !tokens.is('}') && !tokens.is(')') {
        match tokens.take()? {
            Token::Word(word) => name = word,
            Token::End => return Ok(None),
            _ => {}
        }
    }
    let mut found = None;
    if tokens.is('=') {
        tokens.take()?;
        match name.strip_suffix(".timeSamples") {
            Some(name) => {
                let value = first_sample(tokens)?;
                found = value.map(|value| Attribute { line, name: name.to_owned(), value });
            }
            None if tokens.is('{') => tokens.skip()?,
            None => found = Some(Attribute { line, name, value: value(tokens, 0)? }),
        }
    } else if name.is_empty() {
        return Err((tokens.next.0, format!("{} must not stand here", named(&tokens.next.1))));
    }
    if tokens.is('(') {
        tokens.skip()?;
    }
    Ok(found)
}

fn value(tokens: &mut Tokens<'_>, depth: usize) -> std::result::Result<Value, Mistake> {
    let line = tokens.next.0;
    if depth > DEEPEST_VALUE {
        return Err((line, "brackets are nested too deeply".to_owned()));
    }
    match tokens.take()? {
        Token::Word(word) => Ok(word.parse().map_or(Value::Text(word), Value::Number)),
        Token::Text(text) => Ok(Value::Text(text)),
        Token::Sign(open @ ('[' | '(')) => {
            let close = if open == '[' { ']' } else { ')' };
            let mut values = Vec::new();
            while !tokens.is(close) {
                values.push(value(tokens, depth + 1)?);
                if !tokens.is(close) {
                    tokens.expect(',')?;
                }
            }
            tokens.take()?;
            Ok(Value::List(values))
        }
        found => Err((line, format!("a value must stand here, not {}", named(&found)))),
    }
}

/// The value at the first of the times in braces.
fn first_sample(tokens: &mut Tokens<'_>) -> std::result::Result<Option<Value>, Mistake> {
    tokens.expect('{')?;
    let mut first: Option<(f64, Value)> = None;
    while !tokens.is('}') {
        let line = tokens.next.0;
        let time = match tokens.take()? {
            Token::Word(word) => word.trim_end_matches(':').parse::<f64>().ok(),
            _ => None,
        };
        let Some(time) = time else { return Err((line, "a time must stand here".to_owned())) };
        if tokens.next.1 == Token::Word(":".to_owned()) {
            tokens.take()?;
        }
        let value = value(tokens, 0)?;
        if first.as_ref().is_none_or(|(least, _)| time < *least) {
            first = Some((time, value));
        }
        if tokens.is(',') {
            tokens.take()?;
        }
    }
    tokens.take()?;
    Ok(first.map(|(_, value)| value))
}

fn find<'a>(attributes: &'a [Attribute], name: &str) -> Option<&'a Attribute> {
    // A default stands before time samples, or after: the latter are what is drawn.
    attributes.iter().rev().find(|attribute| attribute.name == name)
}

/// A prim's transform, from its operations in their order.
fn transform(attributes: &[Attribute]) -> std::result::Result<Matrix4<f64>, Mistake> {
    let mut all = Matrix4::identity();
    let Some(Attribute { line, value: Value::List(order), .. }) = find(attributes, "xformOpOrder") else {
        return Ok(all);
    };
    for operation in order {
        let Value::Text(operation) = operation else { continue };
        let Some(Attribute { line, value, .. }) = find(attributes, operation) else {
            return Err((*line, format!("{operation} in xformOpOrder is not read, or has no value")));
        };
        let kind = operation.strip_prefix("xformOp:").unwrap_or(operation).split(':').next().unwrap_or_default();
        let about = |axis: Vector3<f64>| {
            let angle = value.number()?.to_radians();
            Some(Rotation3::new(axis * angle).to_homogeneous())
        };
        let one = match kind {
            "translate" => value.numbers::<3>().map(|by| Matrix4::new_translation(&by.into())),
            "scale" => value.numbers::<3>().map(|by| Matrix4::new_nonuniform_scaling(&by.into())),
            "orient" => value
                .numbers::<4>()
                .map(|[w, x, y, z]| UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).to_homogeneous()),
            "rotateX" => about(Vector3::x()),
            "rotateY" => about(Vector3::y()),
            "rotateZ" => about(Vector3::z()),
            "rotateXYZ" => value.numbers::<3>().map(|angles| {
                // The first of them acts first.
                let [x, y, z] = angles.map(f64::to_radians);
                Rotation3::from_euler_angles(x, y, z).to_homogeneous()
            }),
            // Rows are where the axes go.
            "transform" => match value {
                Value::List(rows) => {
                    let rows: Option<Vec<[f64; 4]>> = rows.iter().map(Value::numbers::<4>).collect();
                    rows.filter(|rows| rows.len() == 4).map(|rows| Matrix4::from_fn(|r, c| rows[c][r]))
                }
                _ => None,
            },
            _ => return Err((*line, format!("the transform {operation} is not read"))),
        };
        all *= one.ok_or_else(|| (*line, format!("the value of {operation} is not of its type")))?;
    }
    Ok(all)
}

impl Curves {
    /// Points of the wanted curve in the prim's own axes and units.
    fn own(&self, wanted: Wanted<'_>) -> std::result::Result<Vec<Vector3<f64>>, Mistake> {
        let path = &self.path;
        let text = |name: &str, default: &'static str| match find(&self.attributes, name) {
            Some(Attribute { line, value: Value::Text(text), .. }) => (*line, text.clone()),
            _ => (self.line, default.to_owned()),
        };
        let (line, kind) = text("type", "cubic");
        if kind != "linear" {
            return Err((line, format!("curves of type {kind} are not read ({path}); make them linear")));
        }
        let (line, wrap) = text("wrap", "nonperiodic");
        match (wrap.as_str(), wanted.closed) {
            ("periodic", false) => return Err((line, format!("{path} is periodic: say `closed = true`"))),
            ("nonperiodic", true) => return Err((line, format!("{path} is not periodic: leave `closed` out"))),
            ("periodic" | "nonperiodic", _) => {}
            (other, _) => return Err((line, format!("curves with wrap = {other} are not read ({path})"))),
        }
        let list = |name: &str| match find(&self.attributes, name) {
            Some(Attribute { line, value: Value::List(values), .. }) => Ok((*line, values)),
            _ => Err((self.line, format!("{path} has no `{name}`"))),
        };
        let (line, counts) = list("curveVertexCounts")?;
        let whole = |value: &Value| value.number().filter(|n| *n >= 0.0 && n.fract() == 0.0).map(|n| n as usize);
        let counts: Option<Vec<usize>> = counts.iter().map(whole).collect();
        let counts = counts.ok_or_else(|| (line, "curveVertexCounts must be whole numbers".to_owned()))?;
        let (line, values) = list("points")?;
        if counts.iter().try_fold(0_usize, |sum, &count| sum.checked_add(count)) != Some(values.len()) {
            let message = format!("{path} has {} points, but curveVertexCounts has others", values.len());
            return Err((line, message));
        }
        let chosen = match wanted.curve {
            None if counts.len() == 1 => 0,
            None => {
                return Err((line, format!("{path} has {} curves, give the number of one as `curve`", counts.len())));
            }
            Some(curve) if curve < counts.len() => curve,
            Some(curve) => return Err((line, format!("there is no curve {curve}: {path} has {}", counts.len()))),
        };
        let first: usize = counts[..chosen].iter().sum();
        let points: Option<Vec<[f64; 3]>> =
            values[first..first + counts[chosen]].iter().map(Value::numbers::<3>).collect();
        let is_finite = |points: &Vec<[f64; 3]>| points.as_flattened().iter().all(|x| x.is_finite());
        let points =
            points.filter(is_finite).ok_or_else(|| (line, "points must be three finite numbers each".to_owned()))?;
        let least = if wanted.closed { 3 } else { 2 };
        if points.len() < least {
            return Err((line, format!("{} points, but there must be at least {least}", points.len())));
        }
        Ok(points.into_iter().map(Vector3::from).collect())
    }
}
