//! Memory use of the linked images and time of each algorithm, compared with tests/budgets.toml.
//!
//! Cycles come from docs/charts/cycles.csv; a separate test checks that the code takes exactly
//! these (tests/tests/cycles.rs).

use super::Workspace;
use super::image::Image;
use super::report::Report;
use anyhow::Context;
use object::{Object, ObjectSection, SectionFlags, SectionKind, elf::SHF_ALLOC};
use serde::Deserialize;
use std::collections::BTreeMap;

/// CCM, SRAM1 and SRAM2 (RM0090, section 2.3); everything else is in flash.
const RAM: [std::ops::Range<u64>; 2] = [0x1000_0000..0x1001_0000, 0x2000_0000..0x4000_0000];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Budgets {
    /// Margin, %: a value further below its budget gets a note.
    margin_percent: u64,
    images: BTreeMap<String, Memory>,
    /// Budgets that `tests/tests/chip_numbers.rs` checks.
    #[serde(rename = "chip")]
    _chip: serde::de::IgnoredAny,
    /// Largest number of cycles of one call, by algorithm.
    cycles: BTreeMap<String, u64>,
}

/// Bytes of flash and RAM, allowed or used.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Memory {
    flash: u64,
    ram: u64,
}

/// Part of an image that occupies memory on the chip.
struct Section {
    address: u64,
    size: u64,
    /// Whether its contents are stored in flash, wherever they are used.
    is_loaded: bool,
}

/// Makes two checks for each image, flash and RAM, and one for each algorithm.
pub(super) fn run(at: &Workspace) -> anyhow::Result<Report> {
    let path = at.root.join("tests/budgets.toml");
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("{} cannot be read", path.display()))?;
    let mut budgets: Budgets = toml::from_str(&text).context("tests/budgets.toml")?;
    let mut report = Report::default();
    report.lines.push(HEADING.into());
    for image in Image::all(at)? {
        let Some(budget) = budgets.images.remove(&image.name) else {
            let problem = format!("{}: no budget in tests/budgets.toml", image.name);
            report.add(Report::fail(vec![problem]));
            continue;
        };
        match measure(&image, at) {
            Ok(used) => report.add(compare(&image.name, budget, used, budgets.margin_percent)),
            Err(error) => report.add(Report::from_error(error)),
        }
    }
    for name in budgets.images.keys() {
        let note = format!("note: {name} has a budget, but firmware/Cargo.toml has no such image");
        report.lines.push(note);
    }
    let path = at.root.join(CYCLES);
    let table =
        std::fs::read_to_string(path).with_context(|| format!("{CYCLES} cannot be read"))?;
    report.add(cycles(&table, &budgets)?);
    Ok(report)
}

fn measure(image: &Image, at: &Workspace) -> anyhow::Result<Memory> {
    let bytes = std::fs::read(image.path(at));
    let bytes = bytes.with_context(|| format!("{} is not built", image.name))?;
    let file = object::File::parse(&*bytes).context(image.name.clone())?;
    Ok(usage(file.sections().filter_map(allocated_section)))
}

/// Returns the section if it occupies memory on the chip.
fn allocated_section<'a>(section: impl ObjectSection<'a>) -> Option<Section> {
    let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
        return None;
    };
    sh_flags.contains(SHF_ALLOC).then(|| Section {
        address: section.address(),
        size: section.size(),
        is_loaded: section.kind() != SectionKind::UninitializedData,
    })
}

fn usage(sections: impl Iterator<Item = Section>) -> Memory {
    let mut used = Memory::default();
    for section in sections {
        let is_ram = RAM.iter().any(|ram| ram.contains(&section.address));
        used.ram += if is_ram { section.size } else { 0 };
        used.flash += if section.is_loaded { section.size } else { 0 };
    }
    used
}

/// Table of each algorithm's cycles on the chip simulator.
const CYCLES: &str = "docs/charts/cycles.csv";

/// Row of that table: the largest number of cycles under each of the two interpretations of the
/// flash documentation.
#[derive(Deserialize)]
struct CycleRow {
    algorithm: String,
    max_cycles: u64,
    max_cycles_prefetched_not_cached: u64,
}

impl CycleRow {
    /// Returns the larger number of cycles of the two interpretations. No board has shown which is
    /// right, so a budget covers both.
    fn max_budget(&self) -> u64 {
        self.max_cycles.max(self.max_cycles_prefetched_not_cached)
    }
}

/// Checks each algorithm of `table`. Lists only those that fail or have too large a margin, because
/// the table shows the others.
fn cycles(table: &str, budgets: &Budgets) -> anyhow::Result<Report> {
    let mut report = Report::default();
    let mut without_row = budgets.cycles.clone();
    for row in csv::Reader::from_reader(table.as_bytes()).deserialize() {
        let row: CycleRow = row.context(CYCLES)?;
        let (name, used) = (row.algorithm.as_str(), row.max_budget());
        let Some(budget) = without_row.remove(name) else {
            let problem = format!("{name}: no cycle budget in tests/budgets.toml");
            report.add(Report::fail(vec![problem]));
            continue;
        };
        let row = format!("{name:<30} {used:>8} cycles, budget {budget:>8}");
        report.add(check_row(row, used, budget, budgets.margin_percent, false));
    }
    for name in without_row.keys() {
        let note = format!("note: {name} has a cycle budget, but is not in {CYCLES}");
        report.lines.push(note);
    }
    let passed = report.passed;
    let line = format!("{passed} algorithms are within their cycle budgets, see {CYCLES}");
    report.lines.push(line);
    Ok(report)
}

/// Returns whether the use is so far below the budget that growth could stay unnoticed.
const fn is_loose(used: u64, budget: u64, margin_percent: u64) -> bool {
    used * 100 < budget * 100u64.saturating_sub(margin_percent)
}

/// Checks one row: it fails above its budget, and is listed if requested or if its margin is too
/// large.
fn check_row(row: String, used: u64, budget: u64, margin_percent: u64, is_listed: bool) -> Report {
    if used > budget {
        return Report::fail(vec![row, "^ exceeds its budget".into()]);
    }
    let mut report = Report::pass();
    let is_loose = is_loose(used, budget, margin_percent);
    if is_listed || is_loose {
        report.lines.push(row);
    }
    if is_loose {
        let note =
            format!("  note: more than {margin_percent} % below its budget: lower the budget?");
        report.lines.push(note);
    }
    report
}

const HEADING: &str = "image         memory         used       budget       free";

fn compare(name: &str, budget: Memory, used: Memory, margin_percent: u64) -> Report {
    let mut report = Report::default();
    let flash = ("flash", used.flash, budget.flash);
    let rows = [flash, ("ram", used.ram, budget.ram)];
    for (memory, used, budget) in rows {
        let free = 100 - 100 * used.cast_signed() / budget.max(1).cast_signed();
        let row = format!("{name:<13} {memory:<6} {used:>9} B {budget:>10} B {free:>8} %");
        report.add(check_row(row, used, budget, margin_percent, true));
    }
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn section(address: u64, size: u64, is_loaded: bool) -> Section {
        Section {
            address,
            size,
            is_loaded,
        }
    }

    #[test]
    fn initial_values_count_in_both_memories() {
        let sections = [
            section(0x0800_0000, 0x188, true),
            section(0x0800_0188, 1000, true),
            section(0x2000_0000, 64, true),
            section(0x2000_0040, 500, false),
            section(0x2001_C000, 4008, false),
            section(0x1000_0000, 8, false),
        ];
        let used = usage(sections.into_iter());
        let expected = Memory {
            flash: 0x188 + 1000 + 64,
            ram: 64 + 500 + 4008 + 8,
        };
        assert_eq!(used, expected);
    }

    #[test]
    fn a_budget_holds_up_to_its_last_byte() {
        let budget = Memory {
            flash: 1000,
            ram: 1000,
        };
        let report = |flash, ram| compare("x", budget, Memory { flash, ram }, 25);
        let fits = report(1000, 750);
        assert_eq!((fits.passed, fits.failed, fits.lines.len()), (2, 0, 2));
        let loose = report(1000, 749);
        assert_eq!((loose.passed, loose.failed, loose.lines.len()), (2, 0, 3));
        let big = report(1001, 800);
        assert_eq!((big.passed, big.failed), (1, 1));
        assert!(big.lines.iter().all(|line| line.len() <= 76));
    }

    #[test]
    fn cycles_are_held_to_their_budgets() {
        let budgets = |most| Budgets {
            margin_percent: 25,
            images: BTreeMap::new(),
            _chip: serde::de::IgnoredAny,
            cycles: [("a".to_owned(), most), ("gone".to_owned(), 9)].into(),
        };
        let heading = "algorithm,calls,checksum,min_cycles,max_cycles,\
                       max_cycles_prefetched_not_cached\n";
        // The larger of both readings counts, whichever it is.
        for most in ["80,70", "70,80", "80,80"] {
            let table = format!("{heading}a,1,0,10,{most}\n");
            let report = |most| cycles(&table, &budgets(most)).unwrap();
            assert_eq!((report(80).passed, report(80).failed), (1, 0));
            assert_eq!(report(80).lines.len(), 2, "one budget without a row");
            assert_eq!((report(79).passed, report(79).failed), (0, 1));
            assert_eq!(report(106).lines.len(), 2);
            assert_eq!(report(107).lines.len(), 4, "too much room");
        }
        let table = |rest: &str| cycles(&format!("{heading}{rest}"), &budgets(80));
        let unknown = table("b,1,0,5,5,5\n").unwrap();
        assert_eq!((unknown.passed, unknown.failed), (0, 1));
        assert!(table("no table\n").is_err());
        assert!(table("a,1,0,5,5,many\n").is_err());
        assert!(cycles("algorithm,max_cycles\na,5\n", &budgets(80)).is_err());
    }

    #[test]
    fn an_elf_file_is_measured_by_its_allocated_sections() {
        let bytes = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        let file = object::File::parse(&*bytes).unwrap();
        if file.format() == object::BinaryFormat::Elf {
            let text = allocated_section(file.section_by_name(".text").unwrap()).unwrap();
            assert!(text.size > 0 && text.is_loaded);
        }
    }

    #[test]
    fn the_committed_budgets_can_be_read() {
        let budgets: Budgets = toml::from_str(include_str!("../../budgets.toml")).unwrap();
        assert!(budgets.images.values().all(|b| b.flash > 0 && b.ram > 0));
        assert!(budgets.margin_percent < 100);
        let table = include_str!("../../../docs/charts/cycles.csv");
        let report = cycles(table, &budgets).unwrap();
        assert_eq!(report.failed, 0, "{:#?}", report.lines);
    }
}
