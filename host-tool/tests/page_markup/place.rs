//! Finds and changes strings and keys of a JSON document.

use serde_json::Value;

/// Position in a document: keys and indices; the last one may be the key itself.
#[derive(Clone, Debug)]
pub struct Place {
    pub way: Vec<String>,
    pub is_key: bool,
}

/// Collects every string and key of `value`, which is at `way`.
pub fn places(value: &Value, way: &[String], text_places: &mut Vec<Place>) {
    let below = |name: String| [way, &[name]].concat();
    match value {
        Value::String(_) => text_places.push(Place {
            way: way.to_vec(),
            is_key: false,
        }),
        Value::Array(items) => {
            for (at, item) in items.iter().enumerate() {
                places(item, &below(at.to_string()), text_places);
            }
        }
        Value::Object(items) => {
            for (name, item) in items {
                let way = below(name.clone());
                places(item, &way, text_places);
                text_places.push(Place { way, is_key: true });
            }
        }
        _ => {}
    }
}

/// Returns the document with `more` appended to the string or key at the place.
pub fn lengthened(document: &Value, place: &Place, more: &str) -> Value {
    let mut longer_document = document.clone();
    let (last, way) = place.way.split_last().unwrap();
    let pointer: String = way
        .iter()
        .map(|text| format!("/{}", escaped(text)))
        .collect();
    let parent = longer_document.pointer_mut(&pointer).unwrap();
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
    longer_document
}

fn escaped(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}
