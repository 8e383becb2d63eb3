//! The `metadata` entry of a session file: an INI text with one group per device.

use super::{CaptureError, MAX_SAMPLERATE_HZ, Probe};

/// Contents of `[device 1]` that describe logic samples.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Metadata {
    pub capture_file: String,
    pub samplerate_hz: u64,
    pub unitsize: usize,
    pub probes: Vec<Probe>,
}

/// Reads the text of the entry. Unknown groups and keys are ignored, as libsigrok does.
pub(super) fn parse(text: &str) -> Result<Metadata, CaptureError> {
    let mut keys = Keys::default();
    let mut in_device = false;
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let bad = |problem| CaptureError::BadMetadata {
            line: index + 1,
            problem,
        };
        if let Some(group) = line.strip_prefix('[') {
            let group = group
                .strip_suffix(']')
                .ok_or_else(|| bad("no closing bracket"))?;
            in_device = group == "device 1";
            if group.starts_with("device ") && !in_device {
                return Err(CaptureError::SeveralDevices);
            }
            continue;
        }
        let (key, value) = line
            .split_once('=')
            .ok_or_else(|| bad("neither a group nor `key=value`"))?;
        if in_device {
            keys.take(key.trim(), value.trim()).map_err(bad)?;
        }
    }
    keys.finish()
}

#[derive(Default)]
struct Keys {
    capture_file: Option<String>,
    samplerate: Option<String>,
    unitsize: Option<u64>,
    probes: Vec<(u64, String)>,
}

impl Keys {
    fn take(&mut self, key: &str, value: &str) -> Result<(), &'static str> {
        match key {
            "capturefile" => self.capture_file = Some(value.to_string()),
            "samplerate" => self.samplerate = Some(value.to_string()),
            "unitsize" => {
                let number = value.parse().map_err(|_| "unitsize is not a number")?;
                self.unitsize = Some(number);
            }
            "total probes" => {
                // Counts disabled probes too, so it may exceed the bits of a sample.
                let number: Result<u64, _> = value.parse();
                number.map_err(|_| "`total probes` is not a number")?;
            }
            _ => {
                if let Some(Ok(number)) = key.strip_prefix("probe").map(str::parse::<u64>) {
                    self.probes.push((number, value.to_string()));
                }
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<Metadata, CaptureError> {
        let missing = |key| CaptureError::MissingKey { key };
        let capture_file = self.capture_file.ok_or(missing("capturefile"))?;
        let text = self.samplerate.ok_or(missing("samplerate"))?;
        let Some(samplerate_hz) = samplerate(&text) else {
            return Err(CaptureError::BadSamplerate { text });
        };
        let unitsize = self.unitsize.ok_or(missing("unitsize"))?;
        if !(1..=8).contains(&unitsize) {
            return Err(CaptureError::BadUnitSize { unitsize });
        }
        if self.probes.is_empty() {
            return Err(CaptureError::NoProbes);
        }
        let mut probes: Vec<Probe> = Vec::new();
        for (number, name) in self.probes {
            let bit = number.wrapping_sub(1);
            let repeated = probes.iter().any(|probe| u64::from(probe.bit) == bit);
            let narrow = u8::try_from(bit).unwrap_or(u8::MAX);
            if repeated || bit >= 8 * unitsize || name.is_empty() {
                return Err(CaptureError::BadProbe { bit: narrow, name });
            }
            probes.push(Probe { bit: narrow, name });
        }
        probes.sort_by_key(|probe| probe.bit);
        Ok(Metadata {
            capture_file,
            samplerate_hz,
            unitsize: unitsize as usize,
            probes,
        })
    }
}

/// Reads a rate such as `24 MHz`, `12.5 MHz` or `1000000`. The unit prefix may have either case,
/// because libsigrok accepts both. Returns `None` if the value is not a whole number of hertz in
/// the allowed range.
fn samplerate(text: &str) -> Option<u64> {
    let split = text
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(text.len());
    let (number, unit) = text.split_at_checked(split)?;
    let unit = unit.trim().to_ascii_lowercase();
    let scale: u64 = match unit.strip_suffix("hz").unwrap_or(&unit) {
        "" => 1,
        "k" => 1_000,
        "m" => 1_000_000,
        "g" => 1_000_000_000,
        _ => return None,
    };
    let (whole, fraction) = number.split_once('.').unwrap_or((number, "0"));
    let divisor = 10_u64.checked_pow(u32::try_from(fraction.len()).ok()?)?;
    let part = fraction.parse::<u64>().ok()?.checked_mul(scale)?;
    if part % divisor != 0 {
        return None;
    }
    let rate = whole.parse::<u64>().ok()?.checked_mul(scale)?;
    let rate = rate.checked_add(part / divisor)?;
    (1..=MAX_SAMPLERATE_HZ).contains(&rate).then_some(rate)
}

#[cfg(test)]
mod tests {
    use super::samplerate;

    #[test]
    fn rates_as_sigrok_writes_them() {
        let cases = [
            ("24 MHz", Some(24_000_000)),
            ("1 mHz", Some(1_000_000)),
            ("12.500000 MHz", Some(12_500_000)),
            ("1.515151 MHz", Some(1_515_151)),
            ("200 kHz", Some(200_000)),
            ("1 GHz", Some(1_000_000_000)),
            ("100000000", Some(100_000_000)),
            ("0 Hz", None),
            ("1.5 Hz", None),
            ("101 GHz", None),
            ("99999999999999999999 GHz", None),
            ("1.0000000000000000000000 MHz", None),
            ("fast", None),
            ("-1 MHz", None),
            ("1. MHz", None),
            ("", None),
        ];
        for (text, rate) in cases {
            assert_eq!(samplerate(text), rate, "{text}");
        }
    }
}
