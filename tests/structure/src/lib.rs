//! The modules of a crate and which file uses which, read from its source.
//!
//! Every file is parsed. Each path that names another module counts, in `use` declarations, in bodies and in the
//! arguments of macros; it leads to the file that defines the item, through any re-exports. Not counted are `mod`
//! declarations, re-exports (a `use` with a visibility), and everything under `#[cfg(test)]`. Method calls name no path and
//! are not seen.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::spanned::Spanned as _;
use syn::visit::{self, Visit};

/// Names of the uses of one file by another.
pub type Edges = BTreeMap<(PathBuf, PathBuf), BTreeSet<String>>;

/// A function with its length.
#[derive(Debug)]
pub struct Function {
    /// The file it stands in, relative to the crate's source folder.
    pub file: PathBuf,
    /// Its name.
    pub name: String,
    /// Lines from `fn` to the closing brace.
    pub lines: usize,
}

/// What is read of a crate.
#[derive(Debug, Default)]
pub struct Sources {
    /// From the using file to the defining one; paths relative to the crate's source folder.
    pub edges: Edges,
    /// All functions outside tests.
    pub functions: Vec<Function>,
}

#[derive(Debug, Default)]
struct Module {
    file: PathBuf,
    children: BTreeMap<String, usize>,
    items: BTreeSet<String>,
    /// Names brought in by `use`, with their full path.
    aliases: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    parent: Option<usize>,
}

struct Reader {
    modules: Vec<Module>,
    /// Paths found, with the module they stand in.
    paths: Vec<(usize, Vec<String>)>,
    functions: Vec<Function>,
}

/// Reads the crate whose root file is `root` (`lib.rs`).
pub fn read(root: &Path) -> Sources {
    let folder = root.parent().unwrap();
    let mut reader = Reader { modules: Vec::new(), paths: Vec::new(), functions: Vec::new() };
    reader.read_file(folder, root, None);
    let mut edges = Edges::new();
    for (module, path) in &reader.paths {
        let from = &reader.modules[*module].file;
        if let Some(to) = reader.resolve(*module, path, 0)
            && to != *from
        {
            edges.entry((from.clone(), to)).or_default().insert(path.join("::"));
        }
    }
    Sources { edges, functions: reader.functions }
}

impl Reader {
    fn read_file(&mut self, folder: &Path, path: &Path, parent: Option<usize>) -> usize {
        let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let file = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let name = path.strip_prefix(folder).unwrap().to_path_buf();
        // Children of `mod.rs` and of the root lie beside it, those of `a.rs` in the folder `a`.
        let stem = path.file_stem().unwrap().to_str().unwrap();
        let children = match (parent, stem) {
            (None, _) | (_, "mod") => path.parent().unwrap().to_path_buf(),
            _ => path.with_extension(""),
        };
        let module = self.add(name, parent);
        self.read_items(folder, &children, module, &file.items);
        module
    }

    fn add(&mut self, file: PathBuf, parent: Option<usize>) -> usize {
        self.modules.push(Module { file, parent, ..Module::default() });
        self.modules.len() - 1
    }

    fn read_items(&mut self, folder: &Path, children: &Path, module: usize, items: &[syn::Item]) {
        for item in items.iter().filter(|i| !is_test(attributes(i))) {
            if let syn::Item::Mod(m) = item {
                let name = m.ident.to_string();
                let child = if let Some((_, items)) = &m.content {
                    let child = self.add(self.modules[module].file.clone(), Some(module));
                    self.read_items(folder, &children.join(&name), child, items);
                    child
                } else {
                    let beside = children.join(&name).with_extension("rs");
                    let inside = children.join(&name).join("mod.rs");
                    self.read_file(folder, if beside.is_file() { &beside } else { &inside }, Some(module))
                };
                self.modules[module].children.insert(name, child);
            } else if let syn::Item::Use(u) = item {
                self.read_use(module, u);
            } else {
                self.modules[module].items.extend(name_of(item));
                Bodies { reader: self, module }.visit_item(item);
            }
        }
    }

    fn read_use(&mut self, module: usize, u: &syn::ItemUse) {
        let reexport = !matches!(u.vis, syn::Visibility::Inherited);
        for (path, alias) in flatten(&u.tree, Vec::new()) {
            if !reexport {
                self.paths.push((module, path.clone()));
            }
            match alias {
                Some(name) => drop(self.modules[module].aliases.insert(name, path)),
                None => self.modules[module].globs.push(path),
            }
        }
    }

    /// The file that defines what `path` names as seen from `module`; `None` for other crates and local names.
    fn resolve(&self, module: usize, path: &[String], depth: usize) -> Option<PathBuf> {
        // Aliases that lead to each other end here.
        if depth > 16 {
            return None;
        }
        let mut at = module;
        let mut rest = path;
        loop {
            let Some((head, tail)) = rest.split_first() else { return Some(self.modules[at].file.clone()) };
            let here = &self.modules[at];
            at = match head.as_str() {
                "crate" => 0,
                "self" => at,
                "super" => here.parent?,
                name if here.children.contains_key(name) => here.children[name],
                name if here.items.contains(name) => return Some(here.file.clone()),
                name if here.aliases.contains_key(name) => {
                    let alias = &here.aliases[name];
                    // `use a::b;` beside a crate or module `a`: an alias must not resolve to itself.
                    if at == module && alias.first() == path.first() && alias.len() == 1 {
                        return None;
                    }
                    let whole: Vec<String> = alias.iter().chain(tail).cloned().collect();
                    return self.resolve(at, &whole, depth + 1);
                }
                _ => {
                    let through = |glob: &Vec<String>| {
                        let whole: Vec<String> = glob.iter().chain(rest).cloned().collect();
                        self.resolve(at, &whole, depth + 1)
                    };
                    return here.globs.iter().find_map(through);
                }
            };
            rest = tail;
        }
    }
}

/// Collects the paths in the bodies of one item.
struct Bodies<'a> {
    reader: &'a mut Reader,
    module: usize,
}

impl Bodies<'_> {
    fn path(&mut self, path: Vec<String>) {
        if path.len() > 1 {
            self.reader.paths.push((self.module, path));
        }
    }

    fn function(&mut self, name: &syn::Ident, from: proc_macro2::Span, body: &syn::Block) {
        let file = self.reader.modules[self.module].file.clone();
        let lines = body.span().end().line - from.start().line + 1;
        self.reader.functions.push(Function { file, name: name.to_string(), lines });
    }

    /// Paths in the arguments of a macro, which are tokens only.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut colons = 0;
        for token in tokens {
            match &token {
                TokenTree::Punct(p) if p.as_char() == ':' => {
                    colons += 1;
                    continue;
                }
                TokenTree::Ident(i) if colons == 2 && !path.is_empty() => path.push(i.to_string()),
                TokenTree::Ident(i) => {
                    self.path(std::mem::take(&mut path));
                    path = vec![i.to_string()];
                }
                TokenTree::Group(g) => {
                    self.path(std::mem::take(&mut path));
                    self.tokens(g.stream());
                }
                _ => self.path(std::mem::take(&mut path)),
            }
            colons = 0;
        }
        self.path(path);
    }
}

impl<'ast> Visit<'ast> for Bodies<'_> {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.path(path.segments.iter().map(|s| s.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    fn visit_item_use(&mut self, u: &'ast syn::ItemUse) {
        for (path, _) in flatten(&u.tree, Vec::new()) {
            self.path(path);
        }
    }

    fn visit_macro(&mut self, m: &'ast syn::Macro) {
        self.tokens(m.tokens.clone());
        visit::visit_macro(self, m);
    }

    fn visit_item_fn(&mut self, f: &'ast syn::ItemFn) {
        self.function(&f.sig.ident, f.sig.span(), &f.block);
        visit::visit_item_fn(self, f);
    }

    fn visit_impl_item_fn(&mut self, f: &'ast syn::ImplItemFn) {
        if !is_test(&f.attrs) {
            self.function(&f.sig.ident, f.sig.span(), &f.block);
            visit::visit_impl_item_fn(self, f);
        }
    }

    fn visit_trait_item_fn(&mut self, f: &'ast syn::TraitItemFn) {
        if let Some(body) = &f.default {
            self.function(&f.sig.ident, f.sig.span(), body);
        }
        visit::visit_trait_item_fn(self, f);
    }
}

/// The paths of a `use` with the name each brings in; `None` for a glob.
fn flatten(tree: &syn::UseTree, mut prefix: Vec<String>) -> Vec<(Vec<String>, Option<String>)> {
    match tree {
        syn::UseTree::Path(p) => {
            prefix.push(p.ident.to_string());
            flatten(&p.tree, prefix)
        }
        syn::UseTree::Name(n) if n.ident == "self" => {
            let name = prefix.last().cloned();
            vec![(prefix, name)]
        }
        syn::UseTree::Name(n) => {
            prefix.push(n.ident.to_string());
            vec![(prefix, Some(n.ident.to_string()))]
        }
        syn::UseTree::Rename(r) => {
            prefix.push(r.ident.to_string());
            vec![(prefix, Some(r.rename.to_string()))]
        }
        syn::UseTree::Glob(_) => vec![(prefix, None)],
        syn::UseTree::Group(g) => g.items.iter().flat_map(|t| flatten(t, prefix.clone())).collect(),
    }
}

fn attributes(item: &syn::Item) -> &[syn::Attribute] {
    match item {
        syn::Item::Const(i) => &i.attrs,
        syn::Item::Enum(i) => &i.attrs,
        syn::Item::Fn(i) => &i.attrs,
        syn::Item::Impl(i) => &i.attrs,
        syn::Item::Macro(i) => &i.attrs,
        syn::Item::Mod(i) => &i.attrs,
        syn::Item::Static(i) => &i.attrs,
        syn::Item::Struct(i) => &i.attrs,
        syn::Item::Trait(i) => &i.attrs,
        syn::Item::Type(i) => &i.attrs,
        syn::Item::Union(i) => &i.attrs,
        syn::Item::Use(i) => &i.attrs,
        _ => &[],
    }
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|a| match &a.meta {
        syn::Meta::List(l) => l.path.is_ident("cfg") && l.tokens.to_string() == "test",
        syn::Meta::Path(p) => p.is_ident("test"),
        syn::Meta::NameValue(_) => false,
    })
}

fn name_of(item: &syn::Item) -> Option<String> {
    Some(match item {
        syn::Item::Const(i) => i.ident.to_string(),
        syn::Item::Enum(i) => i.ident.to_string(),
        syn::Item::Fn(i) => i.sig.ident.to_string(),
        syn::Item::Macro(i) => i.ident.as_ref()?.to_string(),
        syn::Item::Static(i) => i.ident.to_string(),
        syn::Item::Struct(i) => i.ident.to_string(),
        syn::Item::Trait(i) => i.ident.to_string(),
        syn::Item::Type(i) => i.ident.to_string(),
        syn::Item::Union(i) => i.ident.to_string(),
        _ => return None,
    })
}

/// One cycle of files or folders that lie beside each other, with the uses that close it.
#[derive(Debug)]
pub struct Cycle {
    /// Files or folders that lie beside each other.
    pub members: Vec<PathBuf>,
    /// Which file uses what of which, a line each.
    pub uses: Vec<String>,
}

/// Cycles among the files and folders of every folder: all below a folder counts as the folder.
///
/// A cycle of files anywhere is a cycle of entries in the lowest folder that holds them all, so none is missed.
pub fn cycles(edges: &Edges) -> Vec<Cycle> {
    let mut levels: BTreeMap<PathBuf, BTreeMap<(PathBuf, PathBuf), Vec<String>>> = BTreeMap::new();
    for ((from, to), names) in edges {
        let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
        let cut = |p: &Path, n: usize| p.components().take(n).collect::<PathBuf>();
        let names = names.iter().cloned().collect::<Vec<_>>().join(", ");
        let text = format!("{} -> {}: {names}", from.display(), to.display());
        let pair = (cut(from, shared + 1), cut(to, shared + 1));
        levels.entry(cut(from, shared)).or_default().entry(pair).or_default().push(text);
    }
    levels.values().flat_map(cycles_of).collect()
}

fn cycles_of(edges: &BTreeMap<(PathBuf, PathBuf), Vec<String>>) -> Vec<Cycle> {
    let reached = |from: &PathBuf| {
        let mut seen: BTreeSet<PathBuf> = BTreeSet::new();
        let mut stack = vec![from.clone()];
        while let Some(at) = stack.pop() {
            for (_, to) in edges.keys().filter(|(a, _)| *a == at) {
                if seen.insert(to.clone()) {
                    stack.push(to.clone());
                }
            }
        }
        seen
    };
    let nodes: BTreeSet<&PathBuf> = edges.keys().flat_map(|(a, b)| [a, b]).collect();
    let reach: BTreeMap<&PathBuf, BTreeSet<PathBuf>> = nodes.iter().map(|n| (*n, reached(n))).collect();
    let mut done: BTreeSet<&PathBuf> = BTreeSet::new();
    let mut cycles = Vec::new();
    for &node in &nodes {
        if done.contains(node) || !reach[node].contains(node) {
            continue;
        }
        let together = |other: &&&PathBuf| reach[node].contains(**other) && reach[**other].contains(node);
        let members: Vec<&PathBuf> = nodes.iter().filter(together).copied().collect();
        done.extend(&members);
        let inside = |(a, b): &&(PathBuf, PathBuf)| members.contains(&a) && members.contains(&b);
        let uses = edges.keys().filter(inside).flat_map(|pair| edges[pair].clone()).collect();
        cycles.push(Cycle { members: members.into_iter().cloned().collect(), uses });
    }
    cycles
}
