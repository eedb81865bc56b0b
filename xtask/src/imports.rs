//! Files of a crate must not import each other in circles: what goes round cannot be read one after
//! the other.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use syn::visit::{self, Visit};
use syn::{Item, ItemMod, ItemUse, UseTree};

/// A module's path below the crate's root, such as `["scene", "load"]`.
type Module = Vec<String>;

/// The files of a crate that import each other in a circle, one line for each circle.
fn circles(source: &Path) -> Result<Vec<String>> {
    let mut files = BTreeMap::new();
    collect(source, source, &mut files)?;
    let mut imports = BTreeMap::new();
    for (module, file) in &files {
        let text = fs::read_to_string(file).with_context(|| file.display().to_string())?;
        let parsed = syn::parse_file(&text).with_context(|| file.display().to_string())?;
        let mut found = Imports { module, files: &files, found: BTreeSet::new() };
        found.visit_file(&parsed);
        imports.insert(module.clone(), found.found);
    }
    Ok(around(&imports))
}

/// All files below a folder by their modules; those of tests apart, which import what they like.
fn collect(root: &Path, folder: &Path, files: &mut BTreeMap<Module, PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default().to_owned();
        if stem == "tests" {
            continue;
        }
        if path.is_dir() {
            collect(root, &path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let folders = folder.strip_prefix(root)?.iter();
            let mut module: Module =
                folders.map(|part| part.to_string_lossy().into_owned()).collect();
            if !["mod", "lib", "main"].contains(&stem.as_str()) {
                module.push(stem);
            }
            files.insert(module, path);
        }
    }
    Ok(())
}

/// Looks for paths that lead to other files of the crate.
struct Imports<'a> {
    module: &'a Module,
    files: &'a BTreeMap<Module, PathBuf>,
    found: BTreeSet<Module>,
}

impl Imports<'_> {
    /// Takes in a path such as `crate::scene::Scene`.
    fn path(&mut self, path: &[String]) {
        let mut at = match path.first().map(String::as_str) {
            Some("crate") => Vec::new(),
            Some("self") => self.module.clone(),
            Some("super") => self.module[..self.module.len().saturating_sub(1)].to_vec(),
            _ => return,
        };
        for part in &path[1..] {
            if part == "super" {
                at.pop();
                continue;
            }
            at.push(part.clone());
            if !self.files.contains_key(&at) {
                at.pop();
                break;
            }
        }
        if at != *self.module {
            self.found.insert(at);
        }
    }

    fn tree(&mut self, before: &mut Vec<String>, tree: &UseTree) {
        match tree {
            UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.tree(before, &path.tree);
                before.pop();
            }
            UseTree::Name(name) => self.leaf(before, name.ident.to_string()),
            UseTree::Rename(name) => self.leaf(before, name.ident.to_string()),
            UseTree::Glob(_) => self.path(before),
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.tree(before, tree)),
        }
    }

    fn leaf(&mut self, before: &mut Vec<String>, name: String) {
        before.push(name);
        self.path(before);
        before.pop();
    }
}

impl<'ast> Visit<'ast> for Imports<'_> {
    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        self.tree(&mut Vec::new(), &item.tree);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let parts: Vec<_> = path.segments.iter().map(|part| part.ident.to_string()).collect();
        // A single part is what something is visible to, as in `pub(crate)`.
        if parts.len() > 1 {
            self.path(&parts);
        }
        visit::visit_path(self, path);
    }

    fn visit_item(&mut self, item: &'ast Item) {
        // Modules within a file are its tests.
        if !matches!(item, Item::Mod(ItemMod { content: Some(_), .. })) {
            visit::visit_item(self, item);
        }
    }
}

/// The groups of modules of which each leads to every other.
fn around(imports: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<String> {
    let reached: BTreeMap<_, _> =
        imports.keys().map(|module| (module, reached_from(imports, module))).collect();
    let mut told = BTreeSet::new();
    let mut circles = Vec::new();
    for (module, reach) in &reached {
        if told.contains(*module) || !reach.contains(*module) {
            continue;
        }
        let circle = reach.iter().filter(|other| reached[other].contains(*module));
        let names: Vec<_> = circle.clone().map(|module| module.join("::")).collect();
        told.extend(circle.cloned());
        circles.push(names.join(", "));
    }
    circles
}

fn reached_from(imports: &BTreeMap<Module, BTreeSet<Module>>, start: &Module) -> BTreeSet<Module> {
    let mut reached = BTreeSet::new();
    let mut open = vec![start];
    while let Some(module) = open.pop() {
        for next in imports.get(module).into_iter().flatten() {
            if reached.insert(next.clone()) {
                open.push(next);
            }
        }
    }
    reached
}

#[test]
fn files_import_each_other_in_no_circles() {
    let crates = crate::run::root().join("crates");
    let mut found = Vec::new();
    for entry in fs::read_dir(crates).expect("the crates") {
        let folder = entry.expect("a crate").path();
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let of_crate = circles(&folder.join("src")).expect("Rust");
        found.extend(of_crate.into_iter().map(|circle| format!("{name}: {circle}")));
    }
    assert!(found.is_empty(), "files import each other in circles:\n{}", found.join("\n"));
}

#[test]
fn circles_are_found() {
    let folder = std::env::temp_dir().join(format!("lumencast-circles-{}", std::process::id()));
    fs::create_dir_all(folder.join("b")).expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("a file");
    write("lib.rs", "mod a; mod b; mod c; pub use a::A;");
    write("a.rs", "use crate::b::{d::D, B}; pub struct A;");
    write("b/mod.rs", "mod d; pub struct B;");
    write("b/d.rs", "pub struct D; impl D { fn f() { super::super::c::f() } }");
    write("c.rs", "pub fn f() {} mod tests { use crate::a::A; }");
    assert_eq!(circles(&folder).expect("read"), Vec::<String>::new());
    write("c.rs", "pub fn f() -> crate::a::A { crate::a::A }");
    assert_eq!(circles(&folder).expect("read"), ["a, b::d, c"]);
    fs::remove_dir_all(&folder).expect("removed");
}
