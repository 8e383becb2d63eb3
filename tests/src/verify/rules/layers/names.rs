//! Resolution of names: which file of a package defines each name that another file uses.

use super::super::source::Source;
use std::collections::{BTreeMap, BTreeSet};
use syn::visit::{self, Visit};

/// Path of a module below its package; empty for the package itself.
pub(super) type Module = Vec<String>;

/// Dependencies of each module, each with a place at which it is used.
pub(super) type Needs = BTreeMap<Module, BTreeMap<Module, String>>;

/// Modules in a package's `src`, without tests.
pub(super) struct Package<'a> {
    modules: BTreeMap<Module, File<'a>>,
}

/// Names that one file defines, imports and uses.
#[derive(Default)]
struct File<'a> {
    path: &'a str,
    /// Re-exported names with their sources.
    exports: BTreeMap<String, Module>,
    /// Modules all of whose names it re-exports.
    globs: Vec<Module>,
    /// Private imports with their sources.
    imports: BTreeMap<String, Module>,
    /// Items that it defines.
    defines: BTreeSet<String>,
    /// Used paths, from the package's root, with their lines.
    uses: Vec<(Module, usize)>,
}

impl<'a> Package<'a> {
    /// Reads the files of `name`/src. A file that does not parse is left to the compiler.
    pub fn read(name: &str, sources: &'a [Source]) -> Self {
        let shipped = sources
            .iter()
            .filter(|source| source.is_rust() && !source.shipped.is_empty());
        let files = shipped.filter_map(|source| Some((module(name, &source.path)?, source)));
        let files: Vec<_> = files.collect();
        let known: BTreeSet<Module> = files.iter().map(|(module, _)| module.clone()).collect();
        let read = |(module, source): (Module, &'a Source)| {
            let mut reader = Reader {
                known: &known,
                here: module.clone(),
                file: File {
                    path: &source.path,
                    ..File::default()
                },
            };
            if let Ok(parsed) = syn::parse_file(&source.text) {
                reader.visit_file(&parsed);
            }
            (module, reader.file)
        };
        Self {
            modules: files.into_iter().map(read).collect(),
        }
    }

    /// Returns the dependencies of each module, without items defined in a parent module.
    pub fn needs(&self) -> Needs {
        let mut needs = Needs::new();
        for (from, file) in &self.modules {
            let needed = needs.entry(from.clone()).or_default();
            for (path, line) in &file.uses {
                let first = path.first().and_then(|name| file.imports.get(name));
                let path = match first {
                    Some(import) => [import, &path[1..]].concat(),
                    None => path.clone(),
                };
                if let Some(to) = self.defining_module(&path, 0)
                    && !from.starts_with(to)
                {
                    let place = || format!("{}:{line}", file.path);
                    needed.entry(to.clone()).or_insert_with(place);
                }
            }
        }
        needs
    }

    /// Returns the module that defines the item at `path`, through re-exports.
    fn defining_module(&self, path: &[String], depth: usize) -> Option<&Module> {
        let longest = (0..=path.len()).rev();
        let (module, file) = longest
            .filter_map(|end| self.modules.get_key_value(&path[..end]))
            .next()?;
        let (Some(name), true) = (path.get(module.len()), depth < 8) else {
            return Some(module);
        };
        if file.defines.contains(name) {
            return Some(module);
        }
        if let Some(from) = file.exports.get(name) {
            let rest = &path[module.len() + 1..];
            return self.defining_module(&[from, rest].concat(), depth + 1);
        }
        let from_glob = |glob: &Module| {
            let path = [glob.clone(), vec![name.clone()]].concat();
            let to = self.defining_module(&path, depth + 1)?;
            self.modules[to].defines.contains(name).then_some(to)
        };
        Some(file.globs.iter().find_map(from_glob).unwrap_or(module))
    }
}

/// Returns the module of a source file; `None` for programs and other packages.
fn module(package: &str, path: &str) -> Option<Module> {
    let path = path.strip_prefix(package)?.strip_prefix("/src/")?;
    let names = path.strip_suffix(".rs")?.split('/');
    let mut names: Module = names.map(str::to_owned).collect();
    if names[0] == "bin" || names == ["main"] {
        return None;
    }
    names.pop_if(|last| last == "mod" || last == "lib");
    Some(names)
}

/// Visitor of a file and the modules inside it.
struct Reader<'k, 'a> {
    known: &'k BTreeSet<Module>,
    here: Module,
    file: File<'a>,
}

impl Reader<'_, '_> {
    /// Returns the path from the package's root; `None` if it leads outside. Names that may be
    /// imports stay unchanged.
    fn absolute_path(&self, path: &[String]) -> Option<Module> {
        let mut base = self.here.clone();
        let mut rest = path;
        match path.first()?.as_str() {
            "crate" => return Some(path[1..].to_vec()),
            "self" => rest = &path[1..],
            "super" => {
                while let Some((name, after)) = rest.split_first()
                    && name == "super"
                {
                    base.pop();
                    rest = after;
                }
            }
            child => {
                let below = [&base[..], &[child.to_owned()]].concat();
                if !self.known.contains(&below) {
                    return None;
                }
            }
        }
        Some([&base[..], rest].concat())
    }

    fn import(&mut self, tree: &syn::UseTree, before: &[String], is_public: bool) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        let (path, name, at) = match tree {
            syn::UseTree::Path(path) => {
                return self.import(&path.tree, &with(&path.ident), is_public);
            }
            syn::UseTree::Group(group) => {
                let items = group.items.iter();
                return items.for_each(|item| self.import(item, before, is_public));
            }
            syn::UseTree::Name(name) => (with(&name.ident), name.ident.to_string(), &name.ident),
            syn::UseTree::Rename(new) => (with(&new.ident), new.rename.to_string(), &new.ident),
            syn::UseTree::Glob(glob) => {
                let line = glob.star_token.spans[0].start().line;
                match self.absolute_path(before) {
                    Some(path) if is_public => self.file.globs.push(path),
                    Some(path) => self.file.uses.push((path, line)),
                    None => {}
                }
                return;
            }
        };
        let (path, name) = match name.as_str() {
            "self" => (before.to_vec(), before.last().cloned().unwrap_or_default()),
            _ => (path, name),
        };
        let Some(path) = self.absolute_path(&path) else {
            return;
        };
        if is_public {
            self.file.exports.insert(name, path);
        } else {
            self.file.uses.push((path.clone(), at.span().start().line));
            self.file.imports.insert(name, path);
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_, '_> {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        let (attributes, name) = item_name(item);
        if attributes.iter().any(is_test) {
            return;
        }
        if let (Some(name), syn::Item::Mod(_)) = (name, item) {
            self.here.push(name.to_string());
            visit::visit_item(self, item);
            self.here.pop();
            return;
        }
        self.file.defines.extend(name.map(ToString::to_string));
        visit::visit_item(self, item);
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let is_public = !matches!(item.vis, syn::Visibility::Inherited);
        self.import(&item.tree, &[], is_public);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<_> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        let first = path.segments.first();
        let line = first.map_or(1, |s| s.ident.span().start().line);
        let is_import = names.len() > 1 && self.file.imports.contains_key(&names[0]);
        match self.absolute_path(&names) {
            Some(absolute) => self.file.uses.push((absolute, line)),
            None if is_import => self.file.uses.push((names, line)),
            None => {}
        }
        visit::visit_path(self, path);
    }
}

fn is_test(attribute: &syn::Attribute) -> bool {
    let is_cfg = attribute.path().is_ident("cfg");
    let argument = attribute.parse_args::<syn::Ident>();
    is_cfg && argument.is_ok_and(|identifier| identifier == "test")
}

/// Returns an item's attributes, and the name by which others use it.
fn item_name(item: &syn::Item) -> (&[syn::Attribute], Option<&syn::Ident>) {
    use syn::Item;
    match item {
        Item::Const(item_const) => (&item_const.attrs, Some(&item_const.ident)),
        Item::Enum(item_enum) => (&item_enum.attrs, Some(&item_enum.ident)),
        Item::Fn(item_fn) => (&item_fn.attrs, Some(&item_fn.sig.ident)),
        Item::Mod(item_mod) => (&item_mod.attrs, Some(&item_mod.ident)),
        Item::Static(item_static) => (&item_static.attrs, Some(&item_static.ident)),
        Item::Struct(item_struct) => (&item_struct.attrs, Some(&item_struct.ident)),
        Item::Trait(item_trait) => (&item_trait.attrs, Some(&item_trait.ident)),
        Item::Type(item_type) => (&item_type.attrs, Some(&item_type.ident)),
        Item::Impl(item_impl) => (&item_impl.attrs, None),
        Item::Use(item_use) => (&item_use.attrs, None),
        _ => (&[], None),
    }
}
