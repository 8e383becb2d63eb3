//! The JSON schema of a file, generated from its declared fields, for editors and for programs that
//! write such files. The schema contains what each field may be by itself; the rules between fields
//! are only in the reader.

use serde_json::{Map, Value, json};

use super::field::{Condition, Field, Kind, Need, Number, Section};

/// Returns the JSON schema (draft 7) of a file whose top-level fields `section` declares.
pub(crate) fn json_schema(title: &str, section: &Section) -> Value {
    let mut schema = table(section);
    schema["$schema"] = "http://json-schema.org/draft-07/schema#".into();
    schema["title"] = title.into();
    schema
}

fn table(section: &Section) -> Value {
    let mut properties = Map::new();
    let mut required = Vec::new();
    let mut rules = Vec::new();
    for field in section {
        let alone = section.iter().filter(|f| f.name == field.name).count() == 1;
        let own = field_schema(field);
        // If a field has several declarations, the rules select one of them.
        properties.insert(
            field.name.into(),
            if alone { own.clone() } else { json!({}) },
        );
        let must = match field.need {
            Need::Required => json!({ "required": [field.name] }),
            _ => json!({}),
        };
        let never = json!({ "properties": { field.name: false } });
        match field.when {
            None if matches!(field.need, Need::Required) => required.push(field.name),
            None if let Need::RequiredWithout(other) = field.need => {
                rules.push(
                    json!({ "anyOf": [{ "required": [field.name] }, { "required": [other] }] }),
                );
            }
            None => {}
            Some(Condition::Without(other)) => {
                let given = json!({ "required": [other] });
                rules.push(json!({ "if": given, "then": never, "else": must }));
            }
            Some(Condition::Is(tag, words)) => {
                let given = choice_condition(section, tag, words);
                let mut then = must;
                if !alone {
                    then["properties"] = json!({ field.name: own });
                }
                let rule = json!({ "if": given, "then": then });
                rules.push(if alone {
                    with_key(rule, "else", never)
                } else {
                    rule
                });
            }
        }
    }
    let mut schema = json!({
        "type": "object",
        "additionalProperties": false,
        "properties": properties,
    });
    if !required.is_empty() {
        schema["required"] = required.into();
    }
    if !rules.is_empty() {
        schema["allOf"] = rules.into();
    }
    schema
}

/// Returns the JSON schema condition that the field `tag` has one of `words` as its value, or as
/// its default if it is left out.
fn choice_condition(section: &Section, tag: &str, words: &[&str]) -> Value {
    let given = json!({ "properties": { tag: { "enum": words } } });
    let declared = section.iter().find(|f| f.name == tag).map(|f| &f.need);
    match declared {
        Some(Need::OrWord(word)) if words.contains(word) => given,
        _ => with_key(given, "required", json!([tag])),
    }
}

fn with_key(mut value: Value, key: &str, part: Value) -> Value {
    value[key] = part;
    value
}

fn field_schema(field: &Field) -> Value {
    let own = match &field.kind {
        Kind::Text(None) => json!({ "type": "string" }),
        Kind::Text(Some(most)) => {
            json!({ "type": "string", "pattern": "\\S", "maxLength": most })
        }
        Kind::Texts(most) => {
            let item = json!({ "type": "string", "pattern": "\\S", "maxLength": most });
            json!({ "type": "array", "items": item })
        }
        Kind::Flag => json!({ "type": "boolean" }),
        Kind::Choice(words) => json!({ "enum": words }),
        Kind::Whole(number) | Kind::Real(number) => range(number),
        Kind::Wholes(number, _) => json!({ "type": "array", "items": range(number) }),
        Kind::Pairs(number, count, _) => {
            let list = |items: Value, count: usize| json!({ "type": "array", "items": items, "minItems": count, "maxItems": count });
            list(list(range(number), 2), *count)
        }
        Kind::Table(section) => table(section),
        Kind::Tables(section, count) => {
            let list = json!({ "type": "array", "items": table(section), "minItems": count.least });
            match count.most {
                Some(most) => with_key(list, "maxItems", most.into()),
                None => list,
            }
        }
    };
    let own = match &field.need {
        Need::Or(value) => with_key(own, "default", units(*value, field.places())),
        Need::OrWord(word) if matches!(field.kind, Kind::Choice(_)) => {
            with_key(own, "default", json!(word))
        }
        _ => own,
    };
    with_key(own, "description", field.description().into())
}

fn range(number: &Number) -> Value {
    let mut own = json!({ "type": "number" });
    if let Some((min, max)) = number.range {
        own["minimum"] = units(min, number.places);
        own["maximum"] = units(max, number.places);
    }
    own
}

/// Returns `value` · 10^−`places` as a JSON number, without decimal point if it is whole.
fn units(value: i64, places: i32) -> Value {
    let steps = 10_i64.pow(places.unsigned_abs());
    match value % steps {
        0 => (value / steps).into(),
        _ => (value as f64 / steps as f64).into(),
    }
}
