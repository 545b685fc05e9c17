//! Rules of the library's source that no compiler knows: bits must be the same everywhere, and nothing is hidden.

use proc_macro2::{Span, TokenStream, TokenTree};
use syn::visit::{self, Visit};

use crate::source::{is_test, parsed};

/// Names that the library does not use, with the reason.
const NAMES: [(&str, &str); 6] = [
    ("f64", "a Cortex-M4F emulates it"),
    ("f128", "a Cortex-M4F emulates it"),
    ("std", "no_std"),
    ("alloc", "no heap"),
    (
        "mul_add",
        "one rounding or two: the bits differ from core to core",
    ),
    ("include_bytes", "data comes from outside"),
];

#[test]
fn the_library_keeps_its_rules() {
    let mut broken = Vec::new();
    for (file, syntax) in parsed() {
        broken.append(&mut broken_in(&file, &syntax));
        if file.ends_with("mod.rs") {
            broken.push(format!("{file}: thing.rs stands beside thing/"));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

fn broken_in(file: &str, syntax: &syn::File) -> Vec<String> {
    let broken = Vec::new();
    let mut rules = Rules { file, broken };
    rules.visit_file(syntax);
    rules.broken
}

#[test]
fn what_breaks_a_rule_is_found() {
    for (text, word) in [
        ("fn f(x: f64) {}", "f64"),
        ("fn f() -> f32 { 1.0_f64 as f32 }", "f64"),
        ("fn f() { g!(x as f64) }", "f64"),
        ("use std::fmt;", "no_std"),
        ("static X: u8 = 0;", "static"),
        ("fn f(x: f32) -> f32 { x.mul_add(x, x) }", "mul_add"),
        ("fn f(x: Option<u8>) -> u8 { x.unwrap() }", "panic"),
        ("fn f() { unreachable!() }", "panic"),
    ] {
        let broken = broken_in("a.rs", &syn::parse_file(text).expect("Rust"));
        assert!(
            broken.len() == 1 && broken[0].contains(word),
            "{text}: {broken:?}"
        );
    }
    let text = "const X: () = assert!(1 < 2); #[cfg(test)] mod tests { fn f(x: f64) { panic!() } }";
    assert!(broken_in("a.rs", &syn::parse_file(text).expect("Rust")).is_empty());
}

struct Rules<'a> {
    file: &'a str,
    broken: Vec<String>,
}

impl Rules<'_> {
    fn breaks(&mut self, at: Span, what: &str) {
        let line = at.start().line;
        self.broken.push(format!("{}:{line}: {what}", self.file));
    }

    fn tokens(&mut self, tokens: TokenStream) {
        for token in tokens {
            match token {
                TokenTree::Group(group) => self.tokens(group.stream()),
                TokenTree::Ident(ident) => self.visit_ident(&ident),
                TokenTree::Punct(_) | TokenTree::Literal(_) => {}
            }
        }
    }
}

impl<'ast> Visit<'ast> for Rules<'_> {
    /// Unit tests may use what they like.
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_ident(&mut self, ident: &'ast syn::Ident) {
        if let Some((name, reason)) = NAMES.iter().find(|(name, _)| ident == name) {
            self.breaks(ident.span(), &format!("{name}: {reason}"));
        }
    }

    fn visit_lit_float(&mut self, number: &'ast syn::LitFloat) {
        if number.suffix() == "f64" {
            self.breaks(number.span(), "an f64: a Cortex-M4F emulates it");
        }
    }

    fn visit_item_static(&mut self, item: &'ast syn::ItemStatic) {
        self.breaks(
            item.ident.span(),
            "a static: memory belongs to who uses the library",
        );
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        let name = item.path.segments.last().map(|last| last.ident.to_string());
        let panics = [
            "panic",
            "unreachable",
            "todo",
            "unimplemented",
            "assert",
            "assert_eq",
        ];
        // A constant's check fails when it is compiled: `const { assert!(…) }` stands in a block of its own.
        if name.is_some_and(|name| panics.contains(&name.as_str())) {
            self.breaks(item.path.segments[0].ident.span(), "a panic");
        }
        self.tokens(item.tokens.clone());
    }

    /// What a compiler evaluates may refuse to compile.
    fn visit_expr_const(&mut self, _: &'ast syn::ExprConst) {}

    fn visit_item_const(&mut self, _: &'ast syn::ItemConst) {}

    fn visit_expr_method_call(&mut self, call: &'ast syn::ExprMethodCall) {
        if call.method == "unwrap" || call.method == "expect" {
            self.breaks(call.method.span(), "a panic");
        }
        visit::visit_expr_method_call(self, call);
    }
}
