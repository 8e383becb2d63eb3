//! Style sheet of a picture in light and in dark.

use roxmltree::Node;
use simplecss::{AttributeOperator, DeclarationTokenizer, PseudoClass, StyleSheet};

/// Rules for a light screen and for a dark one.
pub struct Sheets<'a> {
    light: StyleSheet<'a>,
    dark: StyleSheet<'a>,
}

/// Returns the rules outside every `@media` block, and those together with the rules for dark.
pub fn split(css: &str) -> (String, String) {
    let (mut light, mut dark) = (String::new(), String::new());
    let mut rest = css;
    while let Some(at) = rest.find("@media") {
        let (before, block) = rest.split_at(at);
        let open = block.find('{').expect("a media rule has a block");
        let close = closing(block, open);
        light.push_str(before);
        dark.push_str(before);
        if block[..open].contains("prefers-color-scheme:dark") {
            dark.push_str(&block[open + 1..close]);
        }
        rest = &block[close + 1..];
    }
    (light + rest, dark + rest)
}

/// Returns the position of the brace that closes the one at `open`.
fn closing(text: &str, open: usize) -> usize {
    let mut depth = 0;
    for (at, letter) in text.char_indices().skip_while(|(at, _)| *at < open) {
        match letter {
            '{' => depth += 1,
            '}' if depth == 1 => return at,
            '}' => depth -= 1,
            _ => {}
        }
    }
    panic!("a block without an end: {text}")
}

impl<'a> Sheets<'a> {
    pub fn parse(light: &'a str, dark: &'a str) -> Self {
        Sheets {
            light: StyleSheet::parse(light),
            dark: StyleSheet::parse(dark),
        }
    }

    /// Returns a property of an element or its ancestors, from the last matching rule, or else from
    /// its attribute.
    pub fn inherited<'n>(&self, node: Node<'n, '_>, name: &str, dark: bool) -> Option<String> {
        node.ancestors()
            .filter(Node::is_element)
            .find_map(|node| self.own(node, name, dark))
    }

    /// Returns a property of the element alone.
    pub fn own(&self, node: Node, name: &str, dark: bool) -> Option<String> {
        let sheet = if dark { &self.dark } else { &self.light };
        let rules = sheet.rules.iter();
        let matching = rules.filter(|rule| rule.selector.matches(&Element(node)));
        let declared = matching.flat_map(|rule| &rule.declarations);
        let inline = node.attribute("style").unwrap_or("");
        let inline = DeclarationTokenizer::from(inline).filter(|d| d.name == name);
        let last = declared
            .copied()
            .filter(|d| d.name == name)
            .chain(inline)
            .last();
        let value = last.map(|d| d.value.to_owned());
        value.or_else(|| node.attribute(name).map(str::to_owned))
    }
}

/// Element as simplecss queries it.
struct Element<'a, 'input>(Node<'a, 'input>);

impl simplecss::Element for Element<'_, '_> {
    fn parent_element(&self) -> Option<Self> {
        self.0.parent_element().map(Element)
    }

    fn prev_sibling_element(&self) -> Option<Self> {
        self.0.prev_sibling_element().map(Element)
    }

    fn has_local_name(&self, name: &str) -> bool {
        self.0.tag_name().name() == name
    }

    fn attribute_matches(&self, name: &str, operator: AttributeOperator<'_>) -> bool {
        self.0
            .attribute(name)
            .is_some_and(|value| operator.matches(value))
    }

    fn pseudo_class_matches(&self, _: PseudoClass<'_>) -> bool {
        false
    }
}
