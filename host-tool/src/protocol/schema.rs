//! Reads the types of messages from their schemas.

use super::{Explanation, Field, TypeDescription, Variant, Words};
use anyhow::{Context, bail};
use postcard_schema::schema::{DataModelType as Ty, DataModelVariant as Content, NamedType};
use std::collections::BTreeMap;

/// Returns a type's name as docs/protocol.md writes it.
pub(super) fn name(t: &NamedType) -> String {
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
        Ty::Tuple([first, ..]) => {
            let count = if let Ty::Tuple(items) = t.ty {
                items.len()
            } else {
                0
            };
            format!("[{}; {count}]", name(first))
        }
        _ => t.name.into(),
    }
}

/// Adds every struct and enum inside `t` to `types`, with its words, which are taken from `words`.
///
/// # Errors
/// Fails if a field or variant has no words or is of a kind that the protocol does not have.
pub(super) fn collect(
    t: &NamedType,
    words: &mut Words,
    types: &mut BTreeMap<String, TypeDescription>,
) -> anyhow::Result<()> {
    if types.contains_key(t.name) {
        return Ok(());
    }
    let mut inside: Vec<&NamedType> = Vec::new();
    let mut about = |name: &str| take(words, t.name, name);
    let description = match t.ty {
        Ty::Option(inner) | Ty::Seq(inner) => return collect(inner, words, types),
        Ty::Tuple(items) => {
            return items
                .iter()
                .try_for_each(|item| collect(item, words, types));
        }
        Ty::NewtypeStruct(inner) => TypeDescription::Struct(vec![Field {
            name: "newtype".into(),
            ty: name(inner),
            about: about("newtype")?,
        }]),
        Ty::Struct(fields) => {
            inside.extend(fields.iter().map(|field| field.ty));
            let field = |field: &&postcard_schema::schema::NamedValue| {
                anyhow::Ok(Field {
                    name: field.name.into(),
                    ty: name(field.ty),
                    about: about(field.name)?,
                })
            };
            TypeDescription::Struct(fields.iter().map(field).collect::<Result<_, _>>()?)
        }
        Ty::Enum(variants) => {
            let mut all = Vec::new();
            for (number, variant) in variants.iter().enumerate() {
                let (mut ty, mut parts) = (None, Vec::new());
                match variant.ty {
                    Content::UnitVariant => {}
                    Content::NewtypeVariant(inner) => {
                        inside.push(inner);
                        ty = Some(name(inner));
                    }
                    Content::StructVariant(fields) => {
                        inside.extend(fields.iter().map(|field| field.ty));
                        let part = |field: &&postcard_schema::schema::NamedValue| {
                            (field.name.to_owned(), name(field.ty))
                        };
                        parts.extend(fields.iter().map(part));
                    }
                    Content::TupleVariant(_) => bail!("{} has a tuple", t.name),
                }
                all.push(Variant {
                    number,
                    name: variant.name.into(),
                    ty,
                    parts,
                    about: about(variant.name)?,
                });
            }
            TypeDescription::Enum(all)
        }
        _ => return Ok(()),
    };
    types.insert(t.name.into(), description);
    inside
        .into_iter()
        .try_for_each(|inner| collect(inner, words, types))
}

fn take(words: &mut Words, of: &str, name: &str) -> anyhow::Result<Explanation> {
    let own = words.get_mut(of).and_then(|own| own.remove(name));
    let own = own.with_context(|| format!("fields.toml has no words for {of}.{name}"))?;
    Ok(own.with_bounds())
}
