//! Contents of the types' schemas: names, variants, sizes.

use postcard_schema::schema::{DataModelType as Ty, DataModelVariant as Variant, NamedType};
use serde_json::Value;
use std::collections::BTreeSet;

/// Removes every variant (type and name) that occurs in `json` from `left`.
pub fn tick_off(t: &NamedType, json: &Value, left: &mut BTreeSet<(String, String)>) {
    match (t.ty, json) {
        (Ty::Option(inner), value) if !value.is_null() => tick_off(inner, value, left),
        (Ty::NewtypeStruct(inner), value) => tick_off(inner, value, left),
        (Ty::Seq(inner), Value::Array(items)) => {
            items.iter().for_each(|item| tick_off(inner, item, left));
        }
        (Ty::Tuple(inner), Value::Array(items)) => {
            let pairs = inner.iter().zip(items);
            pairs.for_each(|(t, item)| tick_off(t, item, left));
        }
        (Ty::Struct(fields), value) => {
            fields
                .iter()
                .for_each(|f| tick_off(f.ty, &value[f.name], left));
        }
        (Ty::Enum(variants), value) => {
            let (name, inside) = match value {
                Value::Object(map) => map.iter().next().expect("one variant"),
                unit => (&unit.as_str().expect("a variant").to_owned(), &Value::Null),
            };
            left.remove(&(t.name.to_owned(), name.clone()));
            let variant = variants.iter().find(|v| v.name == name).expect("known");
            match variant.ty {
                Variant::NewtypeVariant(inner) => tick_off(inner, inside, left),
                Variant::StructVariant(fields) => {
                    fields
                        .iter()
                        .for_each(|f| tick_off(f.ty, &inside[f.name], left));
                }
                _ => {}
            }
        }
        _ => {}
    }
}

/// Returns the length of the longest value, bytes; `bound` gives the largest number of elements of
/// a list, by its path, and of bytes of a text.
pub fn longest(t: &NamedType, path: &str, bound: &dyn Fn(&str) -> usize) -> usize {
    let inside = |t: &NamedType, field: &str| longest(t, &format!("{path}.{field}"), bound);
    match t.ty {
        Ty::Bool | Ty::U8 => 1,
        Ty::U16 | Ty::I16 => 3,
        Ty::U32 | Ty::I32 => 5,
        Ty::U64 => 10,
        Ty::String => 2 + bound(path),
        Ty::Option(inner) => 1 + longest(inner, path, bound),
        Ty::NewtypeStruct(inner) => longest(inner, path, bound),
        Ty::Seq(inner) => 1 + bound(path) * longest(inner, path, bound),
        Ty::Tuple(items) => items.iter().map(|i| longest(i, path, bound)).sum(),
        Ty::Struct(fields) => fields.iter().map(|f| inside(f.ty, f.name)).sum(),
        Ty::Enum(variants) => {
            let variant_length = |v: &Variant, name| match v {
                Variant::NewtypeVariant(inner) => inside(inner, name),
                Variant::StructVariant(fields) => fields.iter().map(|f| inside(f.ty, f.name)).sum(),
                _ => 0,
            };
            1 + variants
                .iter()
                .map(|v| variant_length(v.ty, v.name))
                .max()
                .unwrap_or(0)
        }
        other => panic!("no length for {other:?}"),
    }
}
