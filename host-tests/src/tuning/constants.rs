//! Finding constants in the source.

use std::{
    fs,
    ops::Range,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, Result, bail, ensure};
use syn::{
    Attribute, Expr, ExprLit, ExprUnary, Item, Lit, Meta, UnOp, spanned::Spanned as _, visit::Visit,
};

/// A number with a name in `src/`.
#[derive(Debug, Clone)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// File under `src/`.
    pub file: String,
    /// Its value as it stands there.
    pub text: String,
    /// Its doc comment on one line; where it has none, that of the constant before it.
    pub about: String,
    /// Numbers in the value, as byte ranges of the file; empty if the value is worked out from others.
    numbers: Vec<Range<usize>>,
    is_float: bool,
}

impl Constant {
    /// Whether its numbers are `f32`.
    #[must_use]
    pub const fn is_float(&self) -> bool {
        self.is_float
    }

    /// The file's text with the number at `index` of the value replaced.
    pub fn replaced(&self, source: &str, index: usize, value: f64) -> Result<String> {
        let Some(range) = self.numbers.get(index) else {
            bail!(
                "{}: {} has no number {index} of its own: {}",
                self.file,
                self.name,
                self.text
            );
        };
        ensure!(
            self.is_float || value.fract() == 0.0,
            "{} is an integer, {value} is none",
            self.name
        );
        let number = if self.is_float {
            format!("{value:?}")
        } else {
            format!("{value}")
        };
        Ok(format!(
            "{}{number}{}",
            &source[..range.start],
            &source[range.end..]
        ))
    }
}

/// All constants of `src/` that are numbers, or tuples and arrays of numbers, outside of tests.
pub fn all(source: &Path) -> Result<Vec<Constant>> {
    let mut files = Vec::new();
    collect(source, &mut files)?;
    files.sort();
    let mut found = Vec::new();
    for path in files {
        let name = path.strip_prefix(source)?.display().to_string();
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let tree = syn::parse_file(&text).with_context(|| path.display().to_string())?;
        let mut visitor = Visitor {
            file: name,
            source: &text,
            about: String::new(),
            found: &mut found,
        };
        visitor.visit_file(&tree);
    }
    Ok(found)
}

/// The one constant called `name`: `NAME`, or `FILE:NAME` where several files have one.
pub fn named<'a>(constants: &'a [Constant], name: &str) -> Result<&'a Constant> {
    let (file, name) = name.rsplit_once(':').unwrap_or(("", name));
    let fitting: Vec<&Constant> = constants
        .iter()
        .filter(|constant| constant.name == name && constant.file.contains(file))
        .collect();
    match fitting[..] {
        [only] => Ok(only),
        [] => bail!("no constant {name} in src/{file}: `beamfix tune` lists them"),
        _ => {
            let files: Vec<&str> = fitting.iter().map(|c| c.file.as_str()).collect();
            bail!(
                "{name} stands in {}: say FILE:{name}",
                files.join(" and in ")
            )
        }
    }
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|ending| ending == "rs")
            && path.file_stem().is_some_and(|stem| stem != "tests")
        {
            files.push(path);
        }
    }
    Ok(())
}

struct Visitor<'a> {
    file: String,
    source: &'a str,
    about: String,
    found: &'a mut Vec<Constant>,
}

impl Visitor<'_> {
    fn take(&mut self, name: String, value: &Expr, attributes: &[Attribute]) {
        let about = doc(attributes);
        if !about.is_empty() {
            self.about = about;
        }
        let mut numbers = Numbers::default();
        numbers.take(value);
        if !numbers.is_number {
            return;
        }
        let text = self.source[value.span().byte_range()]
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        self.found.push(Constant {
            name,
            file: self.file.clone(),
            text,
            about: self.about.clone(),
            numbers: numbers.found,
            is_float: numbers.is_float,
        });
    }
}

impl<'ast> Visit<'ast> for Visitor<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        match item {
            Item::Mod(module) if module.ident == "tests" => {}
            Item::Const(one) => self.take(one.ident.to_string(), &one.expr, &one.attrs),
            other => {
                self.about.clear();
                syn::visit::visit_item(self, other);
                self.about.clear();
            }
        }
    }
}

/// The numbers of a value, if it is made of numbers.
#[derive(Default)]
struct Numbers {
    found: Vec<Range<usize>>,
    is_number: bool,
    is_float: bool,
}

impl Numbers {
    fn take(&mut self, value: &Expr) {
        match value {
            Expr::Lit(ExprLit { lit, .. }) => match lit {
                Lit::Int(_) => self.push(value),
                Lit::Float(_) => {
                    self.is_float = true;
                    self.push(value);
                }
                _ => {}
            },
            Expr::Unary(ExprUnary {
                op: UnOp::Neg(_),
                expr,
                ..
            }) if matches!(**expr, Expr::Lit(_)) => {
                let before = self.found.len();
                self.take(expr);
                if let Some(number) = self.found.get_mut(before) {
                    *number = value.span().byte_range();
                }
            }
            Expr::Tuple(tuple) => tuple.elems.iter().for_each(|part| self.take(part)),
            Expr::Array(array) => array.elems.iter().for_each(|part| self.take(part)),
            // Worked out from others: shown, not swept.
            Expr::Binary(_) => self.is_number = true,
            _ => {}
        }
    }

    fn push(&mut self, value: &Expr) {
        self.is_number = true;
        self.found.push(value.span().byte_range());
    }
}

/// A doc comment on one line.
fn doc(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| {
        let Meta::NameValue(pair) = &attribute.meta else {
            return None;
        };
        let Expr::Lit(ExprLit {
            lit: Lit::Str(text),
            ..
        }) = &pair.value
        else {
            return None;
        };
        pair.path
            .is_ident("doc")
            .then(|| text.value().trim().to_owned())
    });
    lines.collect::<Vec<_>>().join(" ")
}
