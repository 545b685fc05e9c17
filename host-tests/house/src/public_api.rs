//! The library's public items with the default features, by rustdoc's JSON: how many, and which.
//!
//! Counted are types, traits, free functions, inherent methods, constants of modules and modules, the crate itself
//! included; what is re-exported counts once. Associated constants and a trait's own items are listed only.
//!
//! The JSON is read as it comes: `rustdoc-types` wants the very nightly that it was made for.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use expect_test::expect_file;
use serde_json::Value;

/// Most items that are counted.
const MAX_ITEMS: usize = 300;

/// A public item.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Item {
    path: String,
    kind: &'static str,
    /// File below `src/` in which it stands.
    file: String,
    is_counted: bool,
}

/// What rustdoc says of the library; says so where there is no nightly toolchain.
fn rustdoc() -> Option<Value> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let target = root.join("target/rustdoc");
    let output = Command::new("cargo")
        .args([
            "+nightly",
            "rustdoc",
            "--package",
            "beamfix",
            "--lib",
            "--quiet",
        ])
        .arg("--target-dir")
        .arg(&target)
        .args(["--", "-Z", "unstable-options", "--output-format", "json"])
        .current_dir(&root)
        // The toolchain that runs this test is another one.
        .env_remove("RUSTC")
        .env_remove("RUSTDOC")
        .env_remove("RUSTUP_TOOLCHAIN")
        .env_remove("CARGO")
        .output()
        .ok()?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        let missing = said.contains("is not installed") || said.contains("no such command");
        assert!(missing, "{said}");
        println!("left out: no nightly toolchain, which rustdoc's JSON needs");
        return None;
    }
    let text = std::fs::read_to_string(target.join("doc/beamfix.json")).expect("rustdoc's JSON");
    Some(serde_json::from_str(&text).expect("JSON"))
}

/// Walks what is reachable from the crate's root by public names.
struct Walk<'a> {
    index: &'a serde_json::Map<String, Value>,
    seen: BTreeSet<u64>,
    items: Vec<Item>,
}

impl<'a> Walk<'a> {
    fn of(&self, id: &Value) -> Option<&'a Value> {
        self.index.get(&id.to_string())
    }

    fn item(&mut self, item: &Value, path: &str, kind: &'static str, is_counted: bool) {
        let file = item["span"]["filename"].as_str().unwrap_or_default();
        self.items.push(Item {
            path: path.to_owned(),
            kind,
            file: file.rsplit("src/").next().unwrap_or(file).to_owned(),
            is_counted,
        });
    }

    fn visit(&mut self, id: &Value, within: &str) {
        let Some(item) = self.of(id) else { return };
        let Some((kind, inner)) = item["inner"].as_object().and_then(|map| map.iter().next())
        else {
            return;
        };
        if kind == "use" {
            let Some(target) = self.of(&inner["id"]) else {
                return;
            };
            match (inner["is_glob"].as_bool(), target["inner"].get("module")) {
                (Some(true), Some(module)) => self.all(&module["items"], within),
                _ => self.visit(&inner["id"], within),
            }
            return;
        }
        if item["crate_id"] != 0 || !self.seen.insert(item["id"].as_u64().unwrap_or_default()) {
            return;
        }
        let name = item["name"].as_str().unwrap_or_default();
        let path = if within.is_empty() {
            name.to_owned()
        } else {
            format!("{within}::{name}")
        };
        match kind.as_str() {
            "module" => {
                self.item(item, &path, "mod", true);
                self.all(&inner["items"], &path);
            }
            "struct" | "enum" | "union" => {
                let kind = if kind == "enum" { "enum" } else { "struct" };
                self.item(item, &path, kind, true);
                for implementation in inner["impls"].as_array().into_iter().flatten() {
                    let Some(implementation) = self.of(implementation) else {
                        continue;
                    };
                    let implementation = &implementation["inner"]["impl"];
                    if implementation["trait"].is_null() {
                        self.members(&implementation["items"], &path);
                    }
                }
            }
            "trait" => {
                self.item(item, &path, "trait", true);
                for id in inner["items"].as_array().into_iter().flatten() {
                    if let Some(member) = self.of(id) {
                        let name = member["name"].as_str().unwrap_or_default();
                        self.item(member, &format!("{path}::{name}"), "of trait", false);
                    }
                }
            }
            "function" => self.item(item, &path, "fn", true),
            "constant" | "static" => self.item(item, &path, "const", true),
            "type_alias" => self.item(item, &path, "type", true),
            "macro" | "proc_macro" => self.item(item, &path, "macro", true),
            other => panic!("{path}: {other} is not counted so far"),
        }
    }

    fn all(&mut self, ids: &Value, within: &str) {
        for id in ids.as_array().into_iter().flatten() {
            self.visit(id, within);
        }
    }

    fn members(&mut self, ids: &Value, within: &str) {
        for id in ids.as_array().into_iter().flatten() {
            let Some(member) = self.of(id) else { continue };
            if member["visibility"] != "public" {
                continue;
            }
            let name = member["name"].as_str().unwrap_or_default();
            let is_method = member["inner"].get("function").is_some();
            let kind = if is_method { "fn" } else { "of type" };
            self.item(member, &format!("{within}::{name}"), kind, is_method);
        }
    }
}

/// The list is `host-tests/golden/public-api.txt`. Where a change is meant, and each new item is needed outside:
/// `UPDATE_EXPECT=1 cargo test --release -p beamfix-house public_api`.
#[test]
fn public_items_are_few_and_known() {
    let Some(json) = rustdoc() else { return };
    let mut walk = Walk {
        index: json["index"].as_object().expect("an index"),
        seen: BTreeSet::new(),
        items: Vec::new(),
    };
    walk.visit(&json["root"], "");
    let mut items = walk.items;
    items.sort();
    let mut rooms = BTreeMap::<&str, usize>::new();
    for item in items.iter().filter(|item| item.is_counted) {
        let room = item.file.split('/').next().unwrap_or_default();
        *rooms.entry(room.trim_end_matches(".rs")).or_default() += 1;
    }
    let count: usize = rooms.values().sum();
    let list: String = items
        .iter()
        .map(|item| format!("{:<8} {}\n", item.kind, item.path))
        .collect();
    println!(
        "{count} public items (at most {MAX_ITEMS}), {} listed",
        items.len()
    );
    for (room, count) in rooms {
        println!("  {room:<14} {count}");
    }
    assert!(count > 25, "the test reads items: {count}");
    expect_file!["../../golden/public-api.txt"].assert_eq(&list);
    assert!(
        count <= MAX_ITEMS,
        "{count} public items, at most {MAX_ITEMS}"
    );
}
