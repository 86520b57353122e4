//! Numbers out of XML elements, and where they stand when they are wrong.

use std::path::Path;
use std::str::FromStr;

use glam::DVec3;
use roxmltree::Node;

use crate::load::LoadError;

/// The file being read, for messages.
#[derive(Clone, Copy)]
pub struct File<'a>(pub &'a Path);

impl File<'_> {
    /// An error at the start of `node`.
    pub fn error(self, node: Node, problem: impl Into<String>) -> LoadError {
        self.error_at(node, node.range().start, problem)
    }

    fn error_at(self, node: Node, byte: usize, problem: impl Into<String>) -> LoadError {
        let line = node.document().text_pos_at(byte).row as usize;
        let problem = format!("<{}>: {}", name(node), problem.into());
        LoadError::new(self.0, line, problem)
    }

    /// The child `name`, which must exist.
    pub fn child<'a, 'i>(self, node: Node<'a, 'i>, name: &str) -> Result<Node<'a, 'i>, LoadError> {
        child(node, name).ok_or_else(|| self.error(node, format!("expected a <{name}> in it")))
    }

    /// All numbers in the text of `node`, comments passed over.
    pub fn list<T: FromStr>(self, node: Node) -> Result<Vec<T>, LoadError> {
        let mut numbers = Vec::new();
        for text in node.children().filter(Node::is_text) {
            let content = text.text().unwrap_or_default();
            for word in content.split_ascii_whitespace() {
                let number = word.parse().map_err(|_| {
                    // Entities would shift this; numbers have none.
                    let offset = word.as_ptr() as usize - content.as_ptr() as usize;
                    let kind = std::any::type_name::<T>();
                    let wanted = if kind.starts_with('f') { "a number" } else { "a whole number" };
                    let word: String = word.chars().take(40).collect();
                    let problem = format!("`{word}`: expected {wanted}");
                    self.error_at(node, text.range().start + offset, problem)
                })?;
                numbers.push(number);
            }
        }
        Ok(numbers)
    }

    /// The text of `node` as exactly `N` numbers, all finite.
    pub fn numbers<const N: usize>(self, node: Node) -> Result<[f64; N], LoadError> {
        let list = self.list::<f64>(node)?;
        if let Some(x) = list.iter().find(|x| !x.is_finite()) {
            return Err(self.error(node, format!("`{x}`: expected a finite number")));
        }
        list.as_slice().try_into().map_err(|_| {
            let noun = if N == 1 { "number" } else { "numbers" };
            self.error(node, format!("{} numbers: expected {N} {noun}", list.len()))
        })
    }

    /// The text of `node` as one number.
    pub fn number(self, node: Node) -> Result<f64, LoadError> {
        self.numbers::<1>(node).map(|[x]| x)
    }

    /// The text of `node` as three numbers.
    pub fn vector(self, node: Node) -> Result<DVec3, LoadError> {
        self.numbers::<3>(node).map(DVec3::from)
    }

    /// The text of `node` as whole numbers from zero.
    pub fn whole<const N: usize>(self, node: Node) -> Result<[u32; N], LoadError> {
        let list = self.list::<u32>(node)?;
        list.as_slice()
            .try_into()
            .map_err(|_| self.error(node, format!("{} whole numbers: expected {N}", list.len())))
    }

    /// The child `name` as one number, or `default`.
    pub fn number_or(self, node: Node, name: &str, default: f64) -> Result<f64, LoadError> {
        child(node, name).map_or(Ok(default), |n| self.number(n))
    }

    /// The child `name` as three numbers, or zeros.
    pub fn vector_or_zero(self, node: Node, name: &str) -> Result<DVec3, LoadError> {
        child(node, name).map_or(Ok(DVec3::ZERO), |n| self.vector(n))
    }

    /// The attribute `name` as a whole number, if it is there.
    pub fn attribute<T: FromStr>(self, node: Node, name: &str) -> Result<Option<T>, LoadError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let parsed = text
            .trim()
            .parse()
            .map_err(|_| self.error(node, format!("{name}=\"{text}\": expected a whole number")))?;
        Ok(Some(parsed))
    }
}

/// The first child element called `name`.
pub fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|n| n.has_tag_name(name))
}

/// All child elements called `name` of the first child element called `group`.
pub fn group<'a, 'i>(
    node: Node<'a, 'i>,
    group: &str,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'i>> {
    let group = child(node, group);
    group.into_iter().flat_map(move |g| g.children().filter(move |n| n.has_tag_name(name)))
}

/// The element's name.
pub fn name<'a>(node: Node<'a, '_>) -> &'a str {
    node.tag_name().name()
}
