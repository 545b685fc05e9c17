//! Where the library can be broken, and the syntax tree with breaks in it.
//!
//! All breaks of a run are built into one program, each behind a question that an environment variable answers:
//! `a - b` becomes `{ let (l, r) = (a, b); if mutant::on(7) { l + r } else { l - r } }`. So one build of the tests serves all, where
//! `cargo mutants` makes one for each.

use std::collections::BTreeSet;

use quote::{ToTokens, quote};
use syn::visit_mut::{self, VisitMut};
use syn::{
    BinOp, Block, Expr, ExprBinary, ExprUnary, ImplItemFn, Item, ItemFn, ReturnType, Signature,
    Stmt, Type, UnOp,
};

/// A break: where it is, what it does, and its number in this run.
#[derive(Clone, Debug)]
pub struct Mutant {
    pub id: u32,
    pub file: String,
    pub line: usize,
    pub column: usize,
    pub function: String,
    pub what: String,
}

/// Walks a file and counts the breaks that are possible in it; those that are chosen are put into the tree.
pub struct Walk<'a> {
    file: &'a str,
    next: u32,
    /// `None`: only count.
    chosen: Option<&'a BTreeSet<u32>>,
    function: String,
    /// In a `const fn`, a constant or a test: nothing can ask there which break is on.
    closed: usize,
    pub found: Vec<Mutant>,
}

impl<'a> Walk<'a> {
    pub fn new(file: &'a str, first: u32, chosen: Option<&'a BTreeSet<u32>>) -> Self {
        Self {
            file,
            next: first,
            chosen,
            function: String::new(),
            closed: 0,
            found: Vec::new(),
        }
    }

    /// The next number, if this break is to be put in.
    fn place(&mut self, (line, column): (usize, usize), what: String) -> Option<u32> {
        if self.closed > 0 {
            return None;
        }
        let id = self.next;
        self.next += 1;
        self.found.push(Mutant {
            id,
            file: self.file.to_string(),
            line,
            column,
            function: self.function.clone(),
            what,
        });
        self.chosen
            .is_some_and(|chosen| chosen.contains(&id))
            .then_some(id)
    }

    /// A function as a whole: returns at once with a value that is nothing's, zero or one.
    fn body(&mut self, signature: &Signature, block: &mut Block) {
        let at = place_of(&signature.ident);
        let mut early: Vec<Stmt> = Vec::new();
        for value in values(&signature.output) {
            let what = format!(
                "return {}",
                if value.is_empty() {
                    "()".into()
                } else {
                    value.to_string()
                }
            );
            if let Some(id) = self.place(at, what) {
                early.push(
                    syn::parse2(quote! { if crate::mutant::on(#id) { return #value; } })
                        .expect("a statement"),
                );
            }
        }
        early.append(&mut block.stmts);
        block.stmts = early;
    }

    fn function(
        &mut self,
        signature: &Signature,
        attributes: &[syn::Attribute],
        block: &mut Block,
    ) {
        let closed = signature.constness.is_some() || is_test(attributes);
        let outer = std::mem::replace(&mut self.function, signature.ident.to_string());
        self.closed += usize::from(closed);
        self.visit_block_mut(block);
        self.body(signature, block);
        self.closed -= usize::from(closed);
        self.function = outer;
    }

    fn binary(&mut self, binary: &ExprBinary) -> Option<Expr> {
        let at = place_of(&binary.op);
        let others = others(&binary.op);
        if others.is_empty() || has_let(&binary.left) || has_let(&binary.right) {
            return None;
        }
        let original = binary.op;
        let mut on = Vec::new();
        for other in others {
            let what = format!("{} by {}", text(&original), text(&other));
            if let Some(id) = self.place(at, what) {
                on.push((id, other));
            }
        }
        if on.is_empty() {
            return None;
        }
        let (left, right) = (&binary.left, &binary.right);
        let broken = match original {
            // One right side only, and only where it would be asked.
            BinOp::And(_) | BinOp::Or(_) => {
                let id = on[0].0;
                let asks = if matches!(original, BinOp::And(_)) {
                    quote!(l)
                } else {
                    quote!(!l)
                };
                quote! { ({ let l: bool = #left; if (#asks) != crate::mutant::on(#id) { #right } else { l } }) }
            }
            _ if is_assignment(&original) => {
                let arms = on.iter().map(
                    |(id, other)| quote! { if crate::mutant::on(#id) { #left #other r; } else },
                );
                quote! { ({ let r = #right; #(#arms)* { #left #original r; } }) }
            }
            _ if is_comparison(&original) => {
                let arms = on
                    .iter()
                    .map(|(id, other)| quote! { if crate::mutant::on(#id) { l #other r } else });
                quote! { ({ let (l, r) = (&(#left), &(#right)); #(#arms)* { l #original r } }) }
            }
            _ => {
                let arms = on
                    .iter()
                    .map(|(id, other)| quote! { if crate::mutant::on(#id) { l #other r } else });
                quote! { ({ let (l, r) = (#left, #right); #(#arms)* { l #original r } }) }
            }
        };
        Some(syn::parse2(broken).expect("an expression"))
    }

    fn unary(&mut self, unary: &ExprUnary) -> Option<Expr> {
        let (UnOp::Neg(_) | UnOp::Not(_)) = unary.op else {
            return None;
        };
        // A negative literal is a constant, not an operation.
        if matches!(*unary.expr, Expr::Lit(_)) {
            return None;
        }
        let id = self.place(
            place_of(&unary.op),
            format!("{} left out", unary.op.to_token_stream()),
        )?;
        let (op, inner) = (&unary.op, &unary.expr);
        Some(
            syn::parse2(
                quote! { ({ let v = #inner; if crate::mutant::on(#id) { v } else { #op v } }) },
            )
            .expect("an expression"),
        )
    }
}

impl VisitMut for Walk<'_> {
    fn visit_item_mut(&mut self, item: &mut Item) {
        match item {
            Item::Const(_) | Item::Static(_) | Item::Macro(_) => {}
            Item::Mod(module) if is_test(&module.attrs) => {}
            _ => visit_mut::visit_item_mut(self, item),
        }
    }

    fn visit_item_fn_mut(&mut self, item: &mut ItemFn) {
        self.function(&item.sig, &item.attrs, &mut item.block);
    }

    fn visit_impl_item_fn_mut(&mut self, item: &mut ImplItemFn) {
        self.function(&item.sig, &item.attrs, &mut item.block);
    }

    fn visit_trait_item_fn_mut(&mut self, item: &mut syn::TraitItemFn) {
        if let Some(block) = &mut item.default {
            self.function(&item.sig, &item.attrs, block);
        }
    }

    // Constants of an `impl` or a trait, types, patterns, lengths of arrays.
    fn visit_impl_item_const_mut(&mut self, _: &mut syn::ImplItemConst) {}
    fn visit_trait_item_const_mut(&mut self, _: &mut syn::TraitItemConst) {}
    fn visit_type_mut(&mut self, _: &mut Type) {}
    fn visit_pat_mut(&mut self, _: &mut syn::Pat) {}
    fn visit_generic_argument_mut(&mut self, _: &mut syn::GenericArgument) {}
    fn visit_expr_repeat_mut(&mut self, repeat: &mut syn::ExprRepeat) {
        self.visit_expr_mut(&mut repeat.expr);
    }
    fn visit_expr_const_mut(&mut self, _: &mut syn::ExprConst) {}

    fn visit_arm_mut(&mut self, arm: &mut syn::Arm) {
        if let Some((_, guard)) = &mut arm.guard
            && !has_let(guard)
        {
            self.visit_expr_mut(guard);
            let at = place_of(&arm.pat);
            let (yes, no) = (
                self.place(at, "guard by true".into()),
                self.place(at, "guard by false".into()),
            );
            for (id, value) in [(yes, true), (no, false)] {
                if let Some(id) = id {
                    **guard = syn::parse2(
                        quote! { (if crate::mutant::on(#id) { #value } else { #guard }) },
                    )
                    .expect("a guard");
                }
            }
        }
        self.visit_expr_mut(&mut arm.body);
    }

    fn visit_expr_mut(&mut self, expression: &mut Expr) {
        visit_mut::visit_expr_mut(self, expression);
        let broken = match expression {
            Expr::Binary(binary) => self.binary(binary),
            Expr::Unary(unary) => self.unary(unary),
            _ => None,
        };
        if let Some(broken) = broken {
            *expression = broken;
        }
    }
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let text = attribute.to_token_stream().to_string();
        text.contains("test")
    })
}

/// Line and column, from 1, of where it begins.
fn place_of(syntax: &impl ToTokens) -> (usize, usize) {
    let start = syntax
        .to_token_stream()
        .into_iter()
        .next()
        .map(|token| token.span().start());
    start.map_or((0, 0), |start| (start.line, start.column + 1))
}

fn text(op: &BinOp) -> String {
    op.to_token_stream().to_string()
}

/// `let` in a condition: it cannot be moved into a block.
fn has_let(expression: &Expr) -> bool {
    match expression {
        Expr::Let(_) => true,
        Expr::Binary(binary) => has_let(&binary.left) || has_let(&binary.right),
        Expr::Paren(inner) => has_let(&inner.expr),
        _ => false,
    }
}

fn is_comparison(op: &BinOp) -> bool {
    matches!(
        op,
        BinOp::Eq(_) | BinOp::Ne(_) | BinOp::Lt(_) | BinOp::Le(_) | BinOp::Gt(_) | BinOp::Ge(_)
    )
}

fn is_assignment(op: &BinOp) -> bool {
    text(op).ends_with('=') && !is_comparison(op)
}

/// What stands for an operation, as `cargo mutants` has it.
fn others(op: &BinOp) -> Vec<BinOp> {
    let names: &[&str] = match text(op).as_str() {
        "==" => &["!="],
        "!=" => &["=="],
        "&&" => &["||"],
        "||" => &["&&"],
        "<" => &["==", ">"],
        ">" => &["==", "<"],
        "<=" => &[">"],
        ">=" => &["<"],
        "+" => &["-", "*"],
        "-" => &["+", "/"],
        "*" => &["+", "/"],
        "/" => &["%", "*"],
        "%" => &["/", "+"],
        "&" => &["|", "^"],
        "|" => &["&", "^"],
        "^" => &["|", "&"],
        "<<" => &[">>"],
        ">>" => &["<<"],
        "+=" => &["-=", "*="],
        "-=" => &["+=", "/="],
        "*=" => &["+=", "/="],
        "/=" => &["%=", "*="],
        "&=" => &["|=", "^="],
        "|=" => &["&=", "^="],
        "^=" => &["|=", "&="],
        "<<=" => &[">>="],
        ">>=" => &["<<="],
        _ => &[],
    };
    names
        .iter()
        .map(|name| syn::parse_str(name).expect("an operator"))
        .collect()
}

/// What a function might return instead: nothing, no, yes, zero, one, none.
fn values(output: &ReturnType) -> Vec<proc_macro2::TokenStream> {
    let ReturnType::Type(_, kind) = output else {
        return vec![quote!()];
    };
    match kind.to_token_stream().to_string().as_str() {
        "bool" => vec![quote!(false), quote!(true)],
        "u8" | "u16" | "u32" | "u64" | "usize" | "i8" | "i16" | "i32" | "i64" => {
            vec![quote!(0), quote!(1)]
        }
        "f32" => vec![quote!(0.0), quote!(1.0)],
        text if text.starts_with("Option") => vec![quote!(None)],
        _ => vec![],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "
        const FIXED: u32 = 1 + 2;
        const fn also_fixed(a: u32) -> u32 { a + 1 }
        fn least(a: u32, b: u32) -> u32 { if a < b && a != 7 { a - 1 } else { b } }
        #[cfg(test)] mod tests { fn none(a: u32) -> u32 { a + 1 } }
    ";

    /// The places in `TEXT`: two for `<`, one each for `&&` and `!=`, two for `-`, two for the whole.
    #[test]
    fn places_are_found_where_a_break_can_be_asked_for() {
        let mut walk = Walk::new("a.rs", 1, None);
        walk.visit_file_mut(&mut syn::parse_file(TEXT).expect("a file"));
        assert_eq!(walk.found.len(), 8, "{:?}", walk.found);
        assert!(
            walk.found
                .iter()
                .all(|mutant| mutant.function == "least" && mutant.line == 4)
        );
    }

    #[test]
    fn what_is_chosen_stands_in_the_text() {
        let mut file = syn::parse_file(TEXT).expect("a file");
        let chosen = BTreeSet::from([3, 5]);
        Walk::new("a.rs", 1, Some(&chosen)).visit_file_mut(&mut file);
        let text = prettyplease::unparse(&file);
        assert_eq!(text.matches("mutant::on").count(), 2, "{text}");
        assert!(
            text.contains("mutant::on(3u32)") && text.contains("mutant::on(5u32)"),
            "{text}"
        );
        syn::parse_file(&text).expect("a file again");
    }
}
