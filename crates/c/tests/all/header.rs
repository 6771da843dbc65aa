//! The header declares what the library has, with the same arguments.

use std::collections::BTreeMap;

const HEADER: &str = include_str!("../../include/cosserat.h");
const INTERFACE: &str = include_str!("../../src/interface.rs");

/// C's word for a Rust type.
fn in_c(rust: &str) -> String {
    let of = |name: &str| match name {
        "c_char" => "char".to_owned(),
        "f64" => "double".to_owned(),
        "usize" => "size_t".to_owned(),
        "i32" => "int32_t".to_owned(),
        "Handle" => "cosserat_simulation".to_owned(),
        "Snapshot" => "cosserat_snapshot".to_owned(),
        other => panic!("a type that C does not know: {other}"),
    };
    if let Some(to) = rust.strip_prefix("*const ") {
        format!("const {}*", in_c(to))
    } else if let Some(to) = rust.strip_prefix("*mut ") {
        format!("{}*", in_c(to))
    } else {
        of(rust)
    }
}

/// Functions of the interface: result and arguments, each a type with its name.
fn of_rust() -> BTreeMap<String, Vec<String>> {
    let functions = INTERFACE.split("#[unsafe(no_mangle)]").skip(1).map(|text| {
        let head = text.split_once("extern \"C\" fn ").expect("a function").1.split_once('{').expect("a body").0;
        let (name, rest) = head.split_once('(').expect("arguments");
        let (arguments, result) = rest.rsplit_once(')').expect("arguments");
        let result = result.trim().strip_prefix("-> ").map_or("void".to_owned(), in_c);
        let arguments = arguments.split(',').map(str::trim).filter(|own| !own.is_empty()).map(|own| {
            let (name, of) = own.split_once(": ").expect("a type");
            format!("{} {name}", in_c(of))
        });
        (name.to_owned(), std::iter::once(result).chain(arguments).collect())
    });
    functions.collect()
}

/// Declarations of the header.
fn of_c() -> BTreeMap<String, Vec<String>> {
    let mut text = String::new();
    for part in HEADER.split("/*") {
        text.push_str(part.split_once("*/").map_or(part, |(_, after)| after));
    }
    // Stars belong to the type here: `const char *path` is `const char* path`.
    let typed = |own: &str| {
        let (of, name) = own.trim().rsplit_once([' ', '*']).expect("a name");
        let stars = own.matches('*').count();
        format!("{}{} {name}", of.replace('*', "").trim(), "*".repeat(stars))
    };
    let declared = text.split(';').filter(|own| own.contains("cosserat_") && own.contains('(')).map(|own| {
        let own = own.lines().filter(|line| !line.starts_with('#') && !line.starts_with("extern")).collect::<String>();
        let (head, arguments) = own.split_once('(').expect("arguments");
        let head = typed(head);
        let (result, name) = head.rsplit_once(' ').expect("a name");
        let arguments = arguments.trim_end_matches(')').split(',').filter(|own| *own != "void").map(typed);
        (name.to_owned(), std::iter::once(result.to_owned()).chain(arguments).collect())
    });
    declared.collect()
}

#[test]
fn the_header_declares_the_functions_of_the_library() {
    let [rust, c] = [of_rust(), of_c()];
    assert_eq!(rust.len(), 23);
    assert_eq!(rust, c);
}

#[test]
fn codes_are_the_same() {
    use cosserat_c::handle::Code;
    for (name, code) in [
        ("COSSERAT_NOT_CONVERGED", Code::NotConverged),
        ("COSSERAT_BAD_INPUT", Code::BadInput),
        ("COSSERAT_INTERNAL", Code::Internal),
    ] {
        assert!(HEADER.contains(&format!("{name} = {}", code as i32)), "{name}");
    }
}
