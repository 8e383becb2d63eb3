//! Intel HEX, with 32-bit addresses. The crate `ihex` reads and writes the records.

use super::{ContainerError, Segment, check_span};
use ihex::Record;

/// Data bytes in one record.
const RECORD_LENGTH: usize = 16;

/// Writes an Intel HEX file.
///
/// # Errors
/// [`ContainerError::AddressSpace`].
pub fn write_hex(segments: &[Segment]) -> Result<String, ContainerError> {
    let mut text = String::new();
    let mut upper = None;
    for segment in segments {
        check_span(segment)?;
        let mut address = segment.address;
        let mut rest = segment.bytes.as_slice();
        while !rest.is_empty() {
            let high = (address >> 16) as u16;
            if upper != Some(high) {
                upper = Some(high);
                push(&mut text, &Record::ExtendedLinearAddress(high));
            }
            let offset = (address & 0xFFFF) as u16;
            // A record must not cross a 64 KiB boundary.
            let room = 0x1_0000 - usize::from(offset);
            let length = rest.len().min(RECORD_LENGTH).min(room);
            let (value, behind) = rest.split_at(length);
            push(
                &mut text,
                &Record::Data {
                    offset,
                    value: value.to_vec(),
                },
            );
            rest = behind;
            address = address.wrapping_add(u32::try_from(length).unwrap_or_default());
        }
    }
    push(&mut text, &Record::EndOfFile);
    Ok(text)
}

fn push(text: &mut String, record: &Record) {
    // A record with at most 255 data bytes, as all records here, always has a text.
    if let Ok(line) = record.to_record_string() {
        text.push_str(&line);
        text.push('\n');
    }
}

/// Reads an Intel HEX file. Adjacent records are joined; start addresses are ignored.
///
/// # Errors
/// [`ContainerError::HexLine`] for the first invalid line, [`ContainerError::HexEnd`] without an
/// end record. No input panics.
pub fn read_hex(text: &str) -> Result<Vec<Segment>, ContainerError> {
    let mut segments: Vec<Segment> = Vec::new();
    let mut base = 0_u32;
    let mut ended = false;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        let invalid = |reason: String| ContainerError::HexLine {
            line: index + 1,
            reason,
        };
        if ended {
            return Err(invalid("it follows the end record".into()));
        }
        match Record::from_record_string(line).map_err(|error| invalid(error.to_string()))? {
            Record::Data { offset, value } => {
                let address = base
                    .checked_add(offset.into())
                    .ok_or_else(|| invalid("its address exceeds 32 bits".into()))?;
                append(&mut segments, address, &value)?;
            }
            Record::ExtendedLinearAddress(high) => base = u32::from(high) << 16,
            Record::ExtendedSegmentAddress(paragraph) => base = u32::from(paragraph) << 4,
            Record::EndOfFile => ended = true,
            Record::StartLinearAddress(_) | Record::StartSegmentAddress { .. } => {}
        }
    }
    if ended {
        Ok(segments)
    } else {
        Err(ContainerError::HexEnd)
    }
}

fn append(segments: &mut Vec<Segment>, address: u32, value: &[u8]) -> Result<(), ContainerError> {
    let end = |segment: &Segment| u64::from(segment.address) + segment.bytes.len() as u64;
    match segments.last_mut() {
        Some(last) if end(last) == u64::from(address) => {
            last.bytes.extend_from_slice(value);
            check_span(last)
        }
        _ => {
            let segment = Segment {
                address,
                bytes: value.to_vec(),
            };
            check_span(&segment)?;
            segments.push(segment);
            Ok(())
        }
    }
}
