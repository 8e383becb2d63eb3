//! `flexor protocol`: the link protocol as data, for programs that generate a client.

use super::Output;
use crate::protocol::{Protocol, TypeDescription, describe};
use clap::Args;

/// Print the link protocol as data: types, ranges, codes, vectors
///
/// Prints a summary; with --json everything, units and meanings included, from which a client in any language can be generated.
#[derive(Args, Debug)]
pub struct ProtocolArgs {}

/// # Errors
/// Fails if the standard output cannot be written.
pub fn main(_: &ProtocolArgs, output: Output) -> anyhow::Result<()> {
    let protocol = describe()?;
    let json = serde_json::to_value(&protocol)?;
    output.print(|| summary(&protocol), || json)
}

fn summary(protocol: &Protocol) -> String {
    let count = |name: &String| match protocol.types.get(name) {
        Some(TypeDescription::Enum(variants)) => variants.len(),
        _ => 0,
    };
    let [_, responses] = &protocol.messages;
    let length = |list: &serde_json::Value| list.as_array().map_or(0, Vec::len);
    format!(
        "Schema {}, version {}; messages of at most {} bytes.\n\
         {} requests, {} responses, {} types, {} codes of refusals, {} test vectors of\n\
         messages, {} of the setup checksum.\n\
         flexor protocol --json prints them all; docs/protocol.md explains them.",
        protocol.schema,
        protocol.version,
        protocol.max_message_bytes,
        count(&"Request".to_owned()),
        count(responses),
        protocol.types.len(),
        protocol.refusals.len(),
        length(&protocol.vectors),
        length(&protocol.setup_sums),
    )
}
