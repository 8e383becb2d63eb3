//! Finds and changes strings and keys of a JSON document.

use serde_json::Value;

/// Position in a document: keys and indices; the last one may be the key itself.
#[derive(Clone, Debug)]
pub struct Place {
    pub way: Vec<String>,
    pub is_key: bool,
}

/// Collects every string and key of `value`, which is at `way`.
pub fn places(value: &Value, way: &[String], all: &mut Vec<Place>) {
    let below = |name: String| [way, &[name]].concat();
    match value {
        Value::String(_) => all.push(Place {
            way: way.to_vec(),
            is_key: false,
        }),
        Value::Array(items) => {
            for (at, item) in items.iter().enumerate() {
                places(item, &below(at.to_string()), all);
            }
        }
        Value::Object(items) => {
            for (name, item) in items {
                let way = below(name.clone());
                places(item, &way, all);
                all.push(Place { way, is_key: true });
            }
        }
        _ => {}
    }
}

/// Returns the document with `more` appended to the string or key at the place.
pub fn lengthened(document: &Value, place: &Place, more: &str) -> Value {
    let mut whole = document.clone();
    let (last, way) = place.way.split_last().unwrap();
    let pointer: String = way
        .iter()
        .map(|text| format!("/{}", escaped(text)))
        .collect();
    let parent = whole.pointer_mut(&pointer).unwrap();
    match (parent, place.is_key) {
        (Value::Object(items), true) => {
            let value = items.remove(last).unwrap();
            items.insert(format!("{last}{more}"), value);
        }
        (parent, _) => {
            let own = parent.pointer_mut(&format!("/{}", escaped(last))).unwrap();
            *own = format!("{}{more}", own.as_str().unwrap()).into();
        }
    }
    whole
}

fn escaped(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}
