//! The library's source as modules, and who imports whom: paths are resolved to the file that defines the thing,
//! through re-exports.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

/// A module path below the crate's root.
pub type Names = Vec<String>;

/// One file imports from another.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Import {
    /// The file that imports, as a path below `src/`.
    pub from: String,
    /// The file that defines what is imported.
    pub to: String,
    /// First line of the import.
    pub line: usize,
    /// The path as it is written.
    pub written: String,
    /// Only unit tests import it.
    pub in_tests: bool,
}

#[derive(Debug, Default)]
struct Module {
    file: String,
    children: BTreeSet<String>,
    /// Names that a `use` brings in: name and absolute path.
    names: BTreeMap<String, Names>,
    /// Modules of which a `use` brings in everything.
    globs: Vec<Names>,
}

/// Where a path leads.
enum Target {
    Module,
    Item(String),
}

/// All modules of `src/`.
#[derive(Debug, Default)]
pub struct Source {
    modules: BTreeMap<Names, Module>,
    paths: Vec<Found>,
    /// Lines of each file, by its path below `src/`.
    pub lines: BTreeMap<String, usize>,
}

/// A path somewhere in the code.
#[derive(Debug)]
struct Found {
    module: Names,
    segments: Names,
    line: usize,
    in_tests: bool,
}

impl Source {
    /// Reads the library.
    pub fn read() -> Self {
        Self::of(texts())
    }

    /// Reads files: their paths below `src/`, and their texts.
    fn of(files: Vec<(String, String)>) -> Self {
        let mut source = Self::default();
        for (file, text) in files {
            source.lines.insert(file.clone(), text.lines().count());
            let name = file.trim_end_matches(".rs");
            let module: Names = match name {
                "lib" => Vec::new(),
                name => name.split('/').map(str::to_owned).collect(),
            };
            let parsed = parse(&file, &text);
            let mut reader = Reader {
                source: &mut source,
                file,
                module,
                in_tests: false,
            };
            reader.enter();
            reader.visit_file(&parsed);
        }
        source
    }

    /// Every import between two different files, once for each pair, unit tests apart.
    pub fn imports(&self) -> Vec<Import> {
        let mut found = BTreeMap::new();
        for path in &self.paths {
            let Some(absolute) = self.absolute(&path.module, &path.segments) else {
                continue;
            };
            let to = match self.resolve(&absolute, 0) {
                Some(Target::Item(file)) => file,
                // A module that is only named: what is taken from it is another path.
                Some(Target::Module) | None => continue,
            };
            let from = self.modules[&path.module].file.clone();
            if from == to {
                continue;
            }
            let import = Import {
                line: path.line,
                written: path.segments.join("::"),
                in_tests: path.in_tests,
                from: from.clone(),
                to: to.clone(),
            };
            let kept = found
                .entry((from, to, path.in_tests))
                .or_insert_with(|| import.clone());
            if import.line < kept.line {
                *kept = import;
            }
        }
        found.into_values().collect()
    }

    /// The path from the crate's root, if the path starts at a name of this crate.
    fn absolute(&self, module: &[String], segments: &[String]) -> Option<Names> {
        let (first, rest) = segments.split_first()?;
        let at = |start: &[String], rest: &[String]| -> Names { [start, rest].concat() };
        match first.as_str() {
            "crate" | "$crate" => return Some(rest.to_vec()),
            "self" => return Some(at(module, rest)),
            "super" => {
                let (mut up, mut rest) = (module, rest);
                up = &up[..up.len().checked_sub(1)?];
                while let Some((next, after)) = rest.split_first()
                    && next == "super"
                {
                    up = &up[..up.len().checked_sub(1)?];
                    rest = after;
                }
                return Some(at(up, rest));
            }
            _ => {}
        }
        let here = self.modules.get(module)?;
        if let Some(path) = here.names.get(first) {
            return Some(at(path, rest));
        }
        if here.children.contains(first) {
            return Some(at(module, segments));
        }
        here.globs
            .iter()
            .filter(|glob| glob.as_slice() != module)
            .find_map(|glob| self.absolute(glob, segments))
    }

    /// Follows a path from the root through modules and re-exports to the file that defines what it names.
    fn resolve(&self, path: &[String], depth: usize) -> Option<Target> {
        if depth > 16 {
            return None;
        }
        let mut module: Names = Vec::new();
        for (k, name) in path.iter().enumerate() {
            let here = self.modules.get(&module)?;
            if here.children.contains(name) {
                module.push(name.clone());
                continue;
            }
            if let Some(elsewhere) = here.names.get(name) {
                let onward = [elsewhere.as_slice(), &path[k + 1..]].concat();
                return self.resolve(&onward, depth + 1);
            }
            return Some(Target::Item(here.file.clone()));
        }
        Some(Target::Module)
    }
}

/// Every file of the library: its path below `src/`, and its text.
fn texts() -> Vec<(String, String)> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../src");
    let mut files = Vec::new();
    walk(&src, &mut files);
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("a source file");
        let below = path.strip_prefix(&src).expect("below src");
        (below.to_str().expect("UTF-8").replace('\\', "/"), text)
    };
    files.into_iter().map(read).collect()
}

/// Every file of the library: its path below `src/`, and its syntax.
pub fn parsed() -> impl Iterator<Item = (String, syn::File)> {
    texts().into_iter().map(|(file, text)| {
        let syntax = parse(&file, &text);
        (file, syntax)
    })
}

fn parse(file: &str, text: &str) -> syn::File {
    syn::parse_file(text).unwrap_or_else(|error| panic!("{file}: {error}"))
}

fn walk(folder: &Path, files: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            walk(&path, files);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            files.push(path);
        }
    }
}

struct Reader<'a> {
    source: &'a mut Source,
    file: String,
    module: Names,
    in_tests: bool,
}

impl Reader<'_> {
    /// Enters the present module, and its name into its parent.
    fn enter(&mut self) {
        self.here().file = self.file.clone();
        if let Some((name, parent)) = self.module.split_last() {
            let parent = self.source.modules.entry(parent.to_vec()).or_default();
            parent.children.insert(name.clone());
        }
    }

    fn here(&mut self) -> &mut Module {
        self.source.modules.entry(self.module.clone()).or_default()
    }

    fn found(&mut self, segments: Names, line: usize) {
        self.source.paths.push(Found {
            module: self.module.clone(),
            segments,
            line,
            in_tests: self.in_tests,
        });
    }

    fn import(&mut self, tree: &syn::UseTree, before: &[String], is_private: bool) {
        match tree {
            syn::UseTree::Path(path) => {
                let next = [before, &[path.ident.to_string()]].concat();
                self.import(&path.tree, &next, is_private);
            }
            syn::UseTree::Group(group) => {
                for tree in &group.items {
                    self.import(tree, before, is_private);
                }
            }
            syn::UseTree::Name(name) => {
                self.name(before, &name.ident, &name.ident, is_private);
            }
            syn::UseTree::Rename(rename) => {
                self.name(before, &rename.ident, &rename.rename, is_private);
            }
            syn::UseTree::Glob(glob) => {
                let line = glob.star_token.spans[0].start().line;
                if let Some(path) = self.rooted(before) {
                    self.here().globs.push(path);
                    if is_private {
                        self.found([before, &["*".to_owned()]].concat(), line);
                    }
                }
            }
        }
    }

    fn name(
        &mut self,
        before: &[String],
        name: &syn::Ident,
        known_as: &syn::Ident,
        is_private: bool,
    ) {
        let segments = if name == "self" {
            before.to_vec()
        } else {
            [before, &[name.to_string()]].concat()
        };
        let Some(path) = self.rooted(&segments) else {
            return;
        };
        let known_as = match (known_as == "self", path.last()) {
            (true, Some(last)) => last.clone(),
            _ => known_as.to_string(),
        };
        self.here().names.insert(known_as, path);
        // A re-export is no use: it counts where this file itself goes through the name.
        if is_private {
            self.found(segments, name.span().start().line);
        }
    }

    /// The path from the crate's root, if it is written from there, from here or from above.
    fn rooted(&self, segments: &[String]) -> Option<Names> {
        match segments.first()?.as_str() {
            "crate" | "self" | "super" => self.source.absolute(&self.module, segments),
            // Another crate's name leads nowhere from here, and so to no import.
            _ => Some([self.module.as_slice(), segments].concat()),
        }
    }

    fn tokens(&mut self, tokens: TokenStream) {
        let mut segments: Names = Vec::new();
        let (mut line, mut colons) = (0, 0);
        for token in tokens {
            match &token {
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.flush(&mut segments, line);
                        line = ident.span().start().line;
                    }
                    segments.push(ident.to_string());
                    colons = 0;
                }
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                TokenTree::Group(group) => {
                    self.flush(&mut segments, line);
                    colons = 0;
                    self.tokens(group.stream());
                }
                TokenTree::Punct(_) | TokenTree::Literal(_) => {
                    self.flush(&mut segments, line);
                    colons = 0;
                }
            }
        }
        self.flush(&mut segments, line);
    }

    fn flush(&mut self, segments: &mut Names, line: usize) {
        if !segments.is_empty() {
            let segments = std::mem::take(segments);
            self.found(segments, line);
        }
    }
}

/// Whether `#[cfg(test)]` stands before an item.
pub fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute
                .parse_args::<syn::Path>()
                .is_ok_and(|path| path.is_ident("test"))
    })
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        let Some((_, items)) = &item.content else {
            return;
        };
        let was_in_tests = self.in_tests;
        self.in_tests |= is_test(&item.attrs);
        self.module.push(item.ident.to_string());
        self.enter();
        for item in items {
            self.visit_item(item);
        }
        self.module.pop();
        self.in_tests = was_in_tests;
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let is_private = matches!(item.vis, syn::Visibility::Inherited);
        self.import(&item.tree, &[], is_private);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Names = path
            .segments
            .iter()
            .map(|segment| segment.ident.to_string())
            .collect();
        let line = path.segments[0].ident.span().start().line;
        self.found(segments, line);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        self.tokens(item.tokens.clone());
    }

    /// `pub(in crate::x)` imports nothing.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}

    fn visit_attribute(&mut self, _: &'ast syn::Attribute) {}
}

#[test]
fn paths_lead_to_the_files_that_define_things() {
    let files = [
        (
            "lib.rs",
            "pub mod low; pub mod high; pub use high::part::Thing;",
        ),
        (
            "low.rs",
            "use crate::Thing; pub fn f() {} #[cfg(test)] mod tests { use super::*; use crate::high; fn t() { high::g(); f() } }",
        ),
        (
            "high.rs",
            "pub mod part; pub use part::*; use core::fmt; pub fn g() { assert!(crate::low::f()); fmt::write() }",
        ),
        (
            "high/part.rs",
            "use super::super::low; pub struct Thing; impl Thing { fn h() { low::f(); Self::h() } }",
        ),
    ];
    let files = files.map(|(file, text)| (file.to_owned(), text.to_owned()));
    let imports = Source::of(files.into()).imports();
    let found: Vec<_> = imports
        .iter()
        .map(|import| (import.from.as_str(), import.to.as_str(), import.in_tests))
        .collect();
    assert_eq!(
        found,
        [
            ("high.rs", "low.rs", false),
            ("high/part.rs", "low.rs", false),
            ("low.rs", "high.rs", true),
            ("low.rs", "high/part.rs", false),
        ],
        "{imports:#?}"
    );
}
