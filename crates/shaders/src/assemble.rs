//! Shaders from modules that import each other.
//!
//! WGSL has no imports. A line `#import folder/name` of ours stands for a module's text, which comes
//! before that of whoever imports it, once however often it is imported. Names stay as they are: all
//! modules of a shader share one scope, as in vello's shaders. `naga_oil` gives each module a scope of
//! its own by rewriting names in naga's modules. Ours needs neither a compiler nor regular expressions
//! at run time, and what it makes can be read.

use std::collections::BTreeSet;

use thiserror::Error;

/// Why no shader can be assembled.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ImportError {
    /// No module has this name.
    #[error("there is no shader module {0}")]
    Unknown(String),
    /// Modules import each other in a circle.
    #[error("shader modules import each other in a circle: {0}")]
    Circle(String),
}

/// Modules by their names.
#[derive(Clone, Debug)]
pub(crate) struct Modules<'a>(pub(crate) Vec<(&'a str, &'a str)>);

impl Modules<'_> {
    /// A source after the modules that it imports, each after those that it imports itself.
    pub(crate) fn assemble(&self, source: &str) -> Result<String, ImportError> {
        let mut assembly = Assembly { modules: self, open: Vec::new(), done: BTreeSet::new() };
        let mut text = String::new();
        assembly.add(source, &mut text)?;
        Ok(text)
    }
}

struct Assembly<'a> {
    modules: &'a Modules<'a>,
    /// The modules that are being added, each imported by the one before.
    open: Vec<&'a str>,
    done: BTreeSet<&'a str>,
}

impl Assembly<'_> {
    fn add(&mut self, source: &str, text: &mut String) -> Result<(), ImportError> {
        let mut own = String::new();
        for line in source.lines() {
            match line.strip_prefix("#import ") {
                Some(name) => self.import(name.trim(), text)?,
                None => own.extend([line, "\n"]),
            }
        }
        text.push_str(&own);
        Ok(())
    }

    fn import(&mut self, name: &str, text: &mut String) -> Result<(), ImportError> {
        let known = self.modules.0.iter().find(|(known, _)| *known == name);
        let &(name, source) = known.ok_or_else(|| ImportError::Unknown(name.to_owned()))?;
        if self.open.contains(&name) {
            let circle = [&self.open[..], &[name]].concat();
            return Err(ImportError::Circle(circle.join(" → ")));
        }
        if self.done.insert(name) {
            self.open.push(name);
            self.add(source, text)?;
            self.open.pop();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assembled(modules: &[(&str, &str)], source: &str) -> Result<String, ImportError> {
        Modules(modules.to_vec()).assemble(source)
    }

    #[test]
    fn each_module_comes_once_and_before_those_that_import_it() {
        let modules = [("a", "#import b\n#import c\na"), ("b", "#import c\nb"), ("c", "c")];
        assert_eq!(assembled(&modules, "#import a\n#import c\nroot").unwrap(), "c\nb\na\nroot\n");
        assert_eq!(assembled(&modules, "root").unwrap(), "root\n");
    }

    #[test]
    fn unknown_modules_are_refused() {
        let unknown = ImportError::Unknown("gone".to_owned());
        assert_eq!(assembled(&[("a", "#import gone")], "#import a"), Err(unknown));
    }

    #[test]
    fn circles_are_refused() {
        let modules = [("a", "#import b"), ("b", "#import c"), ("c", "#import b")];
        let circle = ImportError::Circle("a → b → c → b".to_owned());
        assert_eq!(assembled(&modules, "#import a"), Err(circle));
        let own = ImportError::Circle("a → a".to_owned());
        assert_eq!(assembled(&[("a", "#import a")], "#import a"), Err(own));
    }
}
