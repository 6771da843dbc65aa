//! The structure of the sources: sizes of crates, numbers of tuned constants, levels and circles of imports between the files of a
//! crate, and who may depend on the crates behind the facade.
//!
//! An import leads from the file with a `use`, or with a path outside of any, to the file that defines the name: re-exports are
//! followed. A circle is a strongly connected component of more than one file (Tarjan 1972). Tests inside files do not
//! count, and methods are not followed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Lines of sources that a crate may have.
const LINES: usize = 12_000;

/// Named numbers that each crate may have at most. Entries only shrink.
const CONSTANTS: [(&str, usize); 32] = [
    ("browser", 1),
    ("catalogue", 1),
    ("chart", 10),
    ("collision", 12),
    ("component", 17),
    ("contact", 15),
    ("copingnet", 6),
    ("correction", 25),
    ("dataset", 1),
    ("dynamics", 28),
    ("equilibria", 77),
    ("evaluate", 20),
    ("evaluation", 32),
    ("export", 24),
    ("friction", 22),
    ("graph", 24),
    ("identify", 48),
    ("jointed", 17),
    ("kernels", 5),
    ("knn", 3),
    ("laws", 10),
    ("live", 18),
    ("mjcf", 14),
    ("optimise", 9),
    ("rod", 34),
    ("scene", 39),
    ("sensitivity", 9),
    ("simulate", 24),
    ("statics", 69),
    ("terminal", 1),
    ("view", 9),
    ("train", 34),
];

/// Files that a chain of imports in a crate may lead through.
const LEVELS: usize = 8;

/// Crates whose chains are longer still, with what they may have at most. Entries only shrink.
const DEEPER: [(&str, usize); 11] = [
    ("component", 9),
    ("dynamics", 13),
    ("equilibria", 10),
    ("evaluate", 15),
    ("export", 9),
    ("jointed", 9),
    ("laws", 9),
    ("mjcf", 11),
    ("rod", 9),
    ("scene", 17),
    ("simulate", 13),
];

/// Crates of the facade that all may name: names, charts, files and pages, which build on `rod` alone.
const FILES: [&str; 4] = ["names", "chart", "export", "view"];

/// Crates of the facade that all may name, since learning works on them.
const LEARNING: [&str; 2] = ["graph", "copingnet"];

/// A crate's name and the folder of its sources.
fn crates() -> Vec<(String, PathBuf)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let entries = fs::read_dir(root.join("crates")).expect("crates").map(|entry| entry.expect("an entry").path());
    let mut crates: Vec<PathBuf> =
        entries.chain([root.join("train")]).filter(|path| path.join("src").is_dir()).collect();
    crates.sort();
    let named = |path: PathBuf| (path.file_name().expect("a name").to_string_lossy().into_owned(), path.join("src"));
    crates.into_iter().map(named).collect()
}

/// Files of Rust below a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.extension() {
            _ if path.is_dir() => found.extend(sources(&path)),
            Some(extension) if extension == "rs" => found.push(path),
            _ => {}
        }
    }
    found.sort();
    found
}

/// The module of a file, as names from the crate's root.
fn module(file: &Path, src: &Path) -> Vec<String> {
    let below = file.strip_prefix(src).expect("below").with_extension("");
    let mut names: Vec<String> = below.iter().map(|name| name.to_string_lossy().into_owned()).collect();
    if names.last().is_some_and(|last| ["mod", "lib", "main"].contains(&last.as_str())) {
        names.pop();
    }
    names
}

/// A text without comments, and without the modules of tests in it.
fn code(text: &str) -> String {
    let without = |line: &str| line.split("//").next().unwrap_or_default().to_owned();
    let mut code = text.lines().map(without).collect::<Vec<_>>().join("\n");
    while let Some(begin) = code.find("#[cfg(test)]\nmod ") {
        let rest = &code[begin..];
        // `mod tests;`, or a body up to a brace at the beginning of a line.
        let is_elsewhere = rest.split('{').next().is_some_and(|head| head.contains(';'));
        let end = rest.find(if is_elsewhere { ";" } else { "\n}" });
        code.replace_range(begin..end.map_or(code.len(), |end| begin + end + 1), "");
    }
    code
}

/// What a tree of names in a `use` names, each as its name here and a path.
fn paths(tree: &str, before: &[String], out: &mut Vec<(String, Vec<String>)>) {
    let tree = tree.trim();
    if let Some(inner) = tree.strip_prefix('{').and_then(|rest| rest.strip_suffix('}')) {
        let mut depth = 0;
        let commas = |c: char| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            c == ',' && depth == 0
        };
        for part in inner.split(commas).filter(|part| !part.trim().is_empty()) {
            paths(part, before, out);
        }
        return;
    }
    let mut path = before.to_vec();
    match tree.split_once("::") {
        Some((first, rest)) => {
            path.push(first.to_owned());
            paths(rest, &path, out);
        }
        None => {
            let (name, here) = tree.split_once(" as ").unwrap_or((tree, tree));
            path.push(name.trim().to_owned());
            out.push((here.trim().to_owned(), path));
        }
    }
}

/// The paths that a text names outright, outside of any `use`, and the names of types and constants.
fn outright(text: &str) -> Vec<Vec<String>> {
    let text = text.replace("(in crate", "(");
    let tokens =
        text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')).map(|token| token.trim_matches(':'));
    let names = tokens.filter(|token| token.contains("::") || token.starts_with(|c: char| c.is_uppercase()));
    names.map(|token| token.split("::").map(str::to_owned).collect()).collect()
}

/// One file, as far as imports go.
struct File {
    module: Vec<String>,
    /// What it imports, each as a path from the crate's root.
    imports: Vec<Vec<String>>,
    /// What it hands on under its own name, from where.
    handed_on: BTreeMap<String, Vec<String>>,
}

impl File {
    fn read(path: &Path, src: &Path) -> Self {
        let module = module(path, src);
        let text = code(&fs::read_to_string(path).expect("a source"));
        let mut file = Self { module: module.clone(), imports: Vec::new(), handed_on: BTreeMap::new() };
        let mut named = Vec::new();
        for statement in text.split(';') {
            let begins = |&at: &usize| at == 0 || statement.as_bytes()[at - 1].is_ascii_whitespace();
            let at = statement.rfind("use ").filter(begins);
            let (before, tree) = at.map_or((statement, None), |at| (&statement[..at], Some(&statement[at + 4..])));
            named.extend(outright(before));
            let Some(tree) = tree else { continue };
            let hands_on = before.lines().last().is_some_and(|line| line.trim_start().starts_with("pub"));
            let mut all = Vec::new();
            paths(tree, &[], &mut all);
            for (name, path) in all {
                match from_root(&path, &module) {
                    Some(path) if hands_on => drop(file.handed_on.insert(name, path)),
                    path => file.imports.extend(path),
                }
            }
        }
        // A name alone is the file's own, or one that it hands on and uses, too.
        named.retain(|path| path.len() > 1 || file.handed_on.contains_key(&path[0]));
        file.imports.extend(named.iter().filter_map(|path| from_root(path, &module)));
        file
    }
}

/// A path of a module as one from the crate's root; `None` for one that leads to another crate.
fn from_root(path: &[String], module: &[String]) -> Option<Vec<String>> {
    let mut here = module.to_vec();
    let mut rest = path;
    match path.first()?.as_str() {
        "crate" => (here, rest) = (Vec::new(), &path[1..]),
        "self" => rest = &path[1..],
        "super" => {
            while rest.first().is_some_and(|name| name == "super") {
                here.pop();
                rest = &rest[1..];
            }
        }
        // A child's name, or another crate's: the former is found among the files.
        _ => {}
    }
    here.extend(rest.iter().filter(|name| *name != "self").cloned());
    Some(here)
}

/// The file that defines what a path names.
fn definition(path: &[String], files: &[File]) -> Option<usize> {
    let mut path = path.to_vec();
    let mut through = None;
    // Names are handed on a few times at most.
    for _ in 0..8 {
        let of = |names: &[String]| files.iter().position(|file| file.module == names);
        let (length, file) = (0..=path.len()).rev().find_map(|length| Some((length, of(&path[..length])?)))?;
        // The root alone says nothing: the path may lead to another crate.
        let next = path.get(length).and_then(|name| files[file].handed_on.get(name));
        match next {
            Some(next) => {
                path = next.iter().chain(&path[length + 1..]).cloned().collect();
                through = Some(file);
            }
            // What a file hands on and does not define is another crate's.
            None => return (through != Some(file) && (length > 0 || path.len() == 1)).then_some(file),
        }
    }
    None
}

/// Strongly connected components of more than one node (Tarjan 1972).
struct Components<'a> {
    edges: &'a [BTreeSet<usize>],
    order: Vec<Option<usize>>,
    low: Vec<usize>,
    stack: Vec<usize>,
    found: Vec<Vec<usize>>,
}

impl<'a> Components<'a> {
    fn of(edges: &'a [BTreeSet<usize>]) -> Vec<Vec<usize>> {
        let count = edges.len();
        let mut all = Self { edges, order: vec![None; count], low: vec![0; count], stack: vec![], found: vec![] };
        let mut visited = 0;
        for node in 0..count {
            if all.order[node].is_none() {
                all.visit(node, &mut visited);
            }
        }
        all.found
    }

    fn visit(&mut self, node: usize, visited: &mut usize) {
        self.order[node] = Some(*visited);
        self.low[node] = *visited;
        *visited += 1;
        self.stack.push(node);
        for &next in &self.edges[node] {
            match self.order[next] {
                None => {
                    self.visit(next, visited);
                    self.low[node] = self.low[node].min(self.low[next]);
                }
                Some(order) if self.stack.contains(&next) => self.low[node] = self.low[node].min(order),
                Some(_) => {}
            }
        }
        if Some(self.low[node]) == self.order[node] {
            let at = self.stack.iter().position(|&other| other == node).expect("on the stack");
            let component = self.stack.split_off(at);
            if component.len() > 1 {
                self.found.push(component);
            }
        }
    }
}

/// The files of a crate, and which of them each imports from.
fn imports(src: &Path) -> (Vec<File>, Vec<BTreeSet<usize>>) {
    let files: Vec<File> = sources(src).iter().map(|path| File::read(path, src)).collect();
    let of = |(own, file): (usize, &File)| {
        let ends = file.imports.iter().filter_map(|path| definition(path, &files));
        ends.filter(|&end| end != own).collect()
    };
    let edges = files.iter().enumerate().map(of).collect();
    (files, edges)
}

/// The longest chain of imports in a crate without circles, as the modules of its files.
fn longest_chain(src: &Path) -> Vec<String> {
    fn chain(file: usize, edges: &[BTreeSet<usize>], known: &mut [Option<Vec<usize>>]) -> Vec<usize> {
        if let Some(known) = &known[file] {
            return known.clone();
        }
        let longest = edges[file].iter().map(|&next| chain(next, edges, known)).max_by_key(Vec::len);
        let mut own = longest.unwrap_or_default();
        own.push(file);
        known[file] = Some(own.clone());
        own
    }
    let (files, edges) = imports(src);
    let mut known = vec![None; files.len()];
    let is_of_tests = |file: &File| file.module.last().is_some_and(|name| name == "tests" || name == "testing");
    let code = (0..files.len()).filter(|&file| !is_of_tests(&files[file]));
    let chains = code.map(|file| chain(file, &edges, &mut known));
    let longest = chains.max_by_key(Vec::len).unwrap_or_default();
    longest.into_iter().rev().map(|file| files[file].module.join("::")).collect()
}

/// Circles of imports in a crate, each as the modules of its files.
fn circles(src: &Path) -> Vec<Vec<String>> {
    let (files, edges) = imports(src);
    let named = |component: Vec<usize>| {
        let mut names: Vec<String> = component.into_iter().map(|file| files[file].module.join("::")).collect();
        names.sort();
        names
    };
    Components::of(&edges).into_iter().map(named).collect()
}

#[test]
fn crates_are_small() {
    for (name, src) in crates() {
        let lines = |path: &PathBuf| fs::read_to_string(path).expect("a source").lines().count();
        let total: usize = sources(&src).iter().map(lines).sum();
        assert!(total <= LINES, "{name} has {total} lines of sources; at most {LINES} are allowed");
    }
}

/// Whether a line of code names a number.
fn is_constant(line: &str) -> bool {
    let line = line.trim_start();
    let named = line.split_once("const ").filter(|(before, _)| before.is_empty() || before.starts_with("pub"));
    let kind = named.and_then(|(_, rest)| rest.split_once(": ")?.1.split_once(" =")).map(|(kind, _)| kind);
    kind.is_some_and(|kind| ["f64", "f32", "usize", "u32", "u64", "i32"].contains(&kind))
}

#[test]
fn constants_are_few() {
    for (name, src) in crates() {
        let count = |path: &PathBuf| {
            let text = fs::read_to_string(path).expect("a source");
            code(&text).lines().filter(|line| is_constant(line)).count()
        };
        let total: usize = sources(&src).iter().map(count).sum();
        let most = CONSTANTS.iter().find(|(own, _)| *own == name).map_or(0, |&(_, most)| most);
        assert!(total <= most, "{name} has {total} named numbers; at most {most} are allowed");
    }
}

#[test]
fn imports_form_no_circles() {
    for (name, src) in crates() {
        let found = circles(&src);
        assert!(found.is_empty(), "the imports of {name} form circles: {found:#?}");
    }
}

#[test]
fn levels_are_few() {
    for (name, src) in crates() {
        let chain = longest_chain(&src);
        let most = DEEPER.iter().find(|(own, _)| *own == name).map_or(LEVELS, |&(_, most)| most);
        assert!(chain.len() <= most, "{name} has {} levels; at most {most} are allowed: {chain:?}", chain.len());
    }
}

/// What the manifest of a folder lists under headings that end in `heading`, by the names of the workspace.
fn listed(folder: &Path, heading: &str) -> BTreeSet<String> {
    let text = fs::read_to_string(folder.join("Cargo.toml")).expect("a manifest");
    let mut listed = BTreeSet::new();
    let mut within = false;
    for line in text.lines() {
        if line.starts_with('[') {
            within = line.strip_suffix(']').is_some_and(|line| line.ends_with(heading));
        } else if within && let Some((name, _)) = line.split_once(['.', ' ']) {
            listed.insert(name.to_owned());
        }
    }
    listed
}

/// Programs, evidence and learning enter by the facade: they list no crate behind it, not even for tests.
#[test]
fn only_the_facade_is_named() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let folder = |(name, src): (String, PathBuf)| (name, src.parent().expect("a folder").to_owned());
    let mut folders: BTreeMap<String, PathBuf> = crates().into_iter().map(folder).collect();
    folders.insert("tests".to_owned(), root.join("tests"));
    // What the facade is made of, with all its features.
    let mut behind = BTreeSet::new();
    let mut waiting = vec!["cosserat".to_owned()];
    while let Some(name) = waiting.pop() {
        let below = listed(&folders[&name], "[dependencies").into_iter().filter(|name| folders.contains_key(name));
        waiting.extend(below.filter(|name| behind.insert(name.clone())));
    }
    assert!(behind.len() > 15, "the facade is made of {behind:?}");
    for file in FILES {
        let below: Vec<String> = listed(&folders[file], "[dependencies").intersection(&behind).cloned().collect();
        let is_known = |name: &String| name == "rod" || FILES.contains(&name.as_str());
        assert!(below.iter().all(is_known), "{file} builds on {below:?}");
    }
    let outside: Vec<_> = folders.iter().filter(|(name, _)| *name != "cosserat" && !behind.contains(*name)).collect();
    for open in FILES.iter().chain(&LEARNING) {
        assert!(behind.remove(*open), "the facade is not made of {open}");
    }
    for (name, folder) in outside {
        let named: Vec<String> = listed(folder, "dependencies").intersection(&behind).cloned().collect();
        assert!(named.is_empty(), "{name} names {named:?}: it enters by cosserat");
    }
}

/// The reading of imports finds the circles of a small crate: it follows what is handed on, sees paths outside of any `use`, and
/// leaves out tests and what other crates define.
#[test]
fn a_circle_is_found() {
    let place = std::env::temp_dir().join(format!("structure-{}", std::process::id()));
    fs::create_dir_all(place.join("b")).expect("a folder");
    let write = |name: &str, text: &str| fs::write(place.join(name), text).expect("a file");
    write("lib.rs", "mod a;\nmod b;\nmod c;\nmod d;\nmod e;\npub use a::A;\n");
    write(
        "a.rs",
        "use crate::b::{\n    Deep,\n    Other as Another, // a comment: use crate::c::C;\n};\nuse crate::c::Thing;\npub struct A;\n",
    );
    write("b.rs", "pub mod deep;\npub use deep::Deep;\npub struct Other;\n");
    write("b/deep.rs", "use super::super::A;\npub struct Deep;\n");
    write("c.rs", "pub use other::Thing;\nuse crate::A;\n#[cfg(test)]\nmod tests {\n    use crate::b::Deep;\n}\n");
    write("d.rs", "#[cfg(test)]\nmod tests;\npub struct D(crate::e::E);\n");
    write("e.rs", "pub struct E;\nfn e() -> super::d::D {\n    unreachable!()\n}\n");
    let mut found = circles(&place);
    fs::remove_dir_all(&place).expect("removed");
    found.sort();
    assert_eq!(found, [["a", "b::deep"], ["d", "e"]]);
}

/// The glossary leads to files that exist, and names each term once.
#[test]
fn the_glossary_leads_to_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let text = fs::read_to_string(root.join("docs/glossary.md")).expect("the glossary");
    let rows = text.lines().filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |"));
    let mut terms = BTreeSet::new();
    for row in rows.filter(|row| !row.starts_with("term |")) {
        let cells: Vec<&str> = row.split(" | ").collect();
        let [term, _, places] = cells[..] else { panic!("three cells a row: {row}") };
        for term in term.split(", ") {
            assert!(terms.insert(term), "'{term}' stands twice");
        }
        for place in places.split('`').skip(1).step_by(2) {
            assert!(root.join("crates").join(place).exists(), "{term}: there is no {place}");
        }
    }
    assert!(terms.len() > 60, "{} terms", terms.len());
}
