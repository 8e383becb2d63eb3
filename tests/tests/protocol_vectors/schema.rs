//! Contents of the types' schemas: names, variants, sizes.

use postcard_schema::schema::{DataModelType as Ty, DataModelVariant as Variant, NamedType};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Rows of a type's table in protocol.md: (field, type) of a struct, (number and variant, contents)
/// of an enum.
pub type Rows = Vec<(String, String)>;

/// Returns a type's name as protocol.md writes it.
pub fn name(t: &NamedType) -> String {
    match t.ty {
        Ty::Bool => "bool".into(),
        Ty::U8 => "u8".into(),
        Ty::U16 => "u16".into(),
        Ty::U32 => "u32".into(),
        Ty::U64 => "u64".into(),
        Ty::I16 => "i16".into(),
        Ty::I32 => "i32".into(),
        Ty::String => "str".into(),
        Ty::Option(inner) => format!("Option<{}>", name(inner)),
        Ty::Seq(inner) => format!("Vec<{}>", name(inner)),
        Ty::Tuple(items) => format!("[{}; {}]", name(items[0]), items.len()),
        Ty::NewtypeStruct(_) | Ty::Struct(_) | Ty::Enum(_) => t.name.into(),
        other => panic!("protocol.md has no name for {other:?}"),
    }
}

/// Collects every struct and enum inside `t`, with its rows.
pub fn tables(t: &NamedType, types: &mut BTreeMap<String, Rows>) {
    let mut rows = vec![];
    match t.ty {
        Ty::Option(inner) | Ty::Seq(inner) => return tables(inner, types),
        Ty::Tuple(items) => return items.iter().for_each(|i| tables(i, types)),
        Ty::NewtypeStruct(inner) => rows.push(("newtype".into(), name(inner))),
        Ty::Struct(fields) => {
            for field in *fields {
                tables(field.ty, types);
                rows.push((field.name.into(), name(field.ty)));
            }
        }
        Ty::Enum(variants) => {
            for (number, variant) in variants.iter().enumerate() {
                let carries = match variant.ty {
                    Variant::UnitVariant => "–".into(),
                    Variant::NewtypeVariant(inner) => {
                        tables(inner, types);
                        name(inner)
                    }
                    Variant::StructVariant(fields) => {
                        fields.iter().for_each(|f| tables(f.ty, types));
                        let parts = fields.iter().map(|f| format!("{}: {}", f.name, name(f.ty)));
                        parts.collect::<Vec<_>>().join(", ")
                    }
                    other => panic!("protocol.md has no words for {other:?}"),
                };
                rows.push((format!("{number} {}", variant.name), carries));
            }
        }
        _ => return,
    }
    types.insert(t.name.into(), rows);
}

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
