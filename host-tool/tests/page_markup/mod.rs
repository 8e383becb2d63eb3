//! Test that markup in any string of any file that a page reads stays text.
//!
//! Every string and every key of every file of a record is extended by harmless letters and then by
//! markup, one at a time: the page with markup must have no element and no attribute that the page
//! with letters lacks.

mod parts;
mod place;

use super::program::{test_folder, write_file};
use super::record_again::{run_json, shortened_session};
use host_core::record::{self, Run};
use host_core::report::{self, ComparedRecord, Report};
use host_core::run::{SessionFile, begin_trial};
use parts::parts;
use place::{Place, lengthened, places};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use studies::laboratory::{NamedResult, rebuild_page, results_body};

const HARMLESS: &str = "harmless";
/// Leaves an attribute, a title, a style, a comment and a table; begins others.
const EVIL: &str = "\"'></title></style></td></table>--><script>flexor()</script>\
                    <flexor-evil onflexor=\"1\"><img src=x onerror='flexor()'>&lt;&flexor;";

/// Returns every page of the record in `dir`, made again, and the comparison with it under the name
/// `called`; `None` if the record is refused.
fn pages(dir: &Path, called: &str) -> Option<Vec<String>> {
    let run = record::load(dir).ok()?;
    let page = report::page(&Report::from_run(&run));
    // With another session file, so that the page shows the differences of files.
    let mut other = run.clone();
    for trial in &mut other.trials {
        trial.session_text.push_str("\n[other]\n");
    }
    let runs = [("one", &run), (called, &other)];
    let records = runs.map(|(name, run)| ComparedRecord::from_run(Path::new(name), run));
    let compare_html = report::document("both", &report::compare_body(&records));
    let named = [dir, dir].map(|dir| NamedResult::read(dir).ok().flatten());
    let named: Vec<NamedResult> = named.into_iter().flatten().collect();
    let compare_page = compare_html + results_body(&named).as_str();
    let result = rebuild_page(dir, &run.trials).ok()?;
    let result = result.map(|path| fs::read_to_string(path).unwrap());
    Some([page, compare_page].into_iter().chain(result).collect())
}

/// Strings of a file that were tried: those accepted, and the number refused.
struct TriedTexts {
    accepted: Vec<String>,
    refused: usize,
}

/// Tries each variant of a page's sources, with harmless letters and with markup.
fn try_all(
    variants: impl Iterator<Item = String>,
    pages_with: &dyn Fn(&str, &str) -> Option<Vec<String>>,
) -> TriedTexts {
    let mut tried = TriedTexts {
        accepted: Vec::new(),
        refused: 0,
    };
    for place in variants {
        let Some((harmless, evil)) = pages_with(&place, HARMLESS).zip(pages_with(&place, EVIL))
        else {
            tried.refused += 1;
            continue;
        };
        for (harmless, evil) in harmless.iter().zip(&evil) {
            let (harmless, evil) = (parts(harmless), parts(evil));
            let new: Vec<_> = evil.difference(&harmless).collect();
            let entities = ["&quot;", "&gt;", "&lt;", "&amp;", "&#39;"];
            let new: Vec<_> = new
                .iter()
                .filter(|text| !entities.contains(&text.as_str()))
                .collect();
            assert!(new.is_empty(), "{place}: {new:?}");
        }
        tried.accepted.push(place);
    }
    tried
}

/// Tries every string and key of the JSON document `file` of the record in `dir`.
fn try_json(dir: &Path, file: &Path) -> TriedTexts {
    let text = fs::read_to_string(file).unwrap();
    let document: Value = serde_json::from_str(&text).unwrap();
    let mut text_places = Vec::new();
    places(&document, &[], &mut text_places);
    assert!(
        text_places.len() > 10,
        "{}: {} places",
        file.display(),
        text_places.len()
    );
    let named = |place: &Place| {
        format!(
            "{}{}",
            place.way.join("/"),
            if place.is_key { " (key)" } else { "" }
        )
    };
    let tried = try_all(text_places.iter().map(named), &|name, more| {
        let place = text_places
            .iter()
            .find(|place| named(place) == name)
            .unwrap();
        fs::write(file, lengthened(&document, place, more).to_string()).unwrap();
        pages(dir, more)
    });
    fs::write(file, text).unwrap();
    println!(
        "{}: {} strings and keys accepted, {} refused",
        file.display(),
        tried.accepted.len(),
        tried.refused
    );
    tried
}

/// Tries the head and the first value of each column in the table `file`.
fn try_table(dir: &Path, file: &Path) {
    let text = fs::read_to_string(file).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let cells = |line: usize| {
        lines[line]
            .split(',')
            .enumerate()
            .map(move |(at, _)| format!("{line} {at}"))
    };
    let positions: Vec<String> = (0..lines.len().min(2)).flat_map(cells).collect();
    let tried = try_all(positions.into_iter(), &|place, more| {
        let (line, at) = place.split_once(' ').unwrap();
        let (line, at): (usize, usize) = (line.parse().unwrap(), at.parse().unwrap());
        let mut cells: Vec<String> = lines[line].split(',').map(str::to_owned).collect();
        // CSV doubles quotes within a cell.
        cells[at] = format!("\"{}{}\"", cells[at], more.replace('"', "\"\""));
        let mut lines: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
        lines[line] = cells.join(",");
        fs::write(file, lines.join("\n") + "\n").unwrap();
        pages(dir, more)
    });
    fs::write(file, text).unwrap();
    println!(
        "{}: {} cells accepted, {} refused",
        file.display(),
        tried.accepted.len(),
        tried.refused
    );
}

/// Makes an experiment's record with two trials on a wearer file, and everything that a page can
/// show.
fn full_record(folder: &Path) -> PathBuf {
    shortened_session(folder, "hamana_exp4_two_point_wearer.toml", 0.2);
    let declaration = "name = \"own\"\ntitle = \"Own\"\nsource = \"nobody\"\n\
        session = \"hamana_exp4_two_point_wearer.toml\"\nseed = 3\ndraws = 1\n\
        measures = [\"charge_mc\"]\n[[factor]]\nname = \"course\"\n\
        [[factor.level]]\nname = \"slow\"\n[[factor.level]]\nname = \"fast\"\n\
        set = { \"setpoints.frequency_hz\" = 0.3 }\n";
    write_file(folder, "own.toml", declaration);
    run_json(folder, "experiment own.toml --draws 0 --out record");
    let dir = folder.join("record");
    let name = record::load(&dir).unwrap().trials[0].name.clone();
    edit(&dir.join("run.json"), |run| {
        run["paper"] = json!([{ "trial": name, "values": [8.4, 9.0], "source": "table 8" }]);
        run["assumptions"] = json!([
            { "role": "put_in", "text": "a finger" }, { "role": "came_out", "text": "its angle" },
        ]);
    });
    for trial in trial_files(&dir) {
        edit(&trial, |trial| {
            trial["channels"][0]["model"] = "none".into();
            trial["electrode_check"] =
                json!([{ "channel": 1, "applied": 5.0, "current_ma": 2.0, "load_ohm": 2500.0 }]);
        });
    }
    dir
}

fn edit(file: &Path, change: impl FnOnce(&mut Value)) {
    let mut document: Value = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
    change(&mut document);
    fs::write(file, document.to_string()).unwrap();
}

fn trial_files(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir)
        .unwrap()
        .flatten()
        .map(|entry| entry.path());
    let trials = entries.map(|path| path.join("trial.json"));
    trials.filter(|path| path.is_file()).collect()
}

#[test]
fn markup_in_a_record_stays_text() {
    let folder = test_folder("page_markup");
    let dir = full_record(&folder);
    try_json(&dir, &dir.join("run.json"));
    try_json(&dir, &dir.join("summary.json"));
    let trial = &trial_files(&dir)[0];
    let tried = try_json(&dir, trial);
    for wanted in [
        "channels/0/unit",
        "channels/0/name",
        "name",
        "session_file",
        "wearer/name",
    ] {
        assert!(tried.accepted.iter().any(|path| path == wanted), "{wanted}");
    }
    try_table(&dir, &trial.with_file_name("samples.csv"));
    try_table(&dir, &trial.with_file_name("edges.csv"));
    // A result with every possible field, one of random cases, one of a grid of many points.
    let result = dir.join("result.json");
    let field = json!({
        "field": "body.mass", "holds": 1.0, "fails": 2.0, "superiority": 0.7, "p": 0.001,
        "p_holm": 0.01, "decides": true, "thirds": [0.1, 0.2, 0.3],
    });
    edit(&result, |result| {
        result["cut_short"] = "the program was killed".into();
        result["shares"] = json!([share("")]);
        result["decides"] = json!([{
            "id": "a", "claim": "more", "holds": 20, "fails": 20, "enough": true, "fields": [field],
        }]);
        result["sheets"] = sheets();
    });
    let tried = try_json(&dir, &result);
    for wanted in [
        "rows/0/unit",
        "rows/0/quantity",
        "title",
        "sheets/0/caption",
    ] {
        assert!(tried.accepted.iter().any(|path| path == wanted), "{wanted}");
    }
    edit(&result, |result| {
        result["declared"]["drawn"] = "cases".into();
        for row in result["rows"].as_array_mut().unwrap() {
            row["quantity"] = "kind/first: a measure".into();
        }
    });
    let tried = try_json(&dir, &result);
    assert!(tried.accepted.iter().any(|path| path == "declared/drawn"));
    edit(&result, |result| {
        let points = (0..25).map(|point| share(&format!("point {point}")));
        result["shares"] = points.collect();
    });
    try_json(&dir, &result);
}

fn share(at: &str) -> Value {
    json!({
        "id": "a", "at": at, "claim": "more", "paper": true, "holds": 3, "of": 4, "low": 0.3,
        "high": 0.9,
    })
}

fn sheets() -> Value {
    let sheet = |number: &str, shows: Value| json!({ "number": number, "title": "of P", "caption": "simulated", "shows": shows });
    let axis =
        json!({ "name": "time (s)", "ends": [0.0, 1.0], "ticks": [[0.0, "none"], [1.0, "all"]] });
    let plot = json!({
        "title": "P", "x": axis, "y": axis,
        "bars": [{ "series": 0, "x": [0.1, 0.3], "value": 0.5, "range": null }],
    });
    json!([
        sheet(
            "Table 8",
            json!({ "table": { "heads": ["", "RMSE"], "rows": [["P", "8.4 %"]] } })
        ),
        sheet(
            "Figure 3",
            json!({ "plots": { "beside": 2, "series": ["ours"], "plots": [plot, plot] } })
        ),
        sheet(
            "Figure 4",
            json!({ "matrix": { "unit": "N", "heads": ["a"], "rows": [["A", [1.0]]] } })
        ),
    ])
}

/// Returns the page of a trial that begins with this session on this wearer.
fn page_of(session: &toml::Table, wearer: &str) -> Option<Vec<String>> {
    let text = toml::to_string(session).unwrap();
    let file = SessionFile::parse_with_wearers("s.toml", &text, &|_| Ok(wearer.to_owned())).ok()?;
    let run = Run {
        title: file.session.title.clone(),
        trials: vec![begin_trial(&file)],
        ..Run::default()
    };
    Some(vec![report::page(&Report::from_run(&run))])
}

#[test]
fn markup_in_a_session_or_a_wearer_file_stays_text() {
    let folder = test_folder("session_markup");
    let name = shortened_session(&folder, "hamana_exp4_two_point_wearer.toml", 0.2);
    let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let session: toml::Table = read(&name).parse().unwrap();
    let file = session["wearer"]["file"].as_str().unwrap();
    let wearer: toml::Table = read(file).parse().unwrap();
    let accepted_paths =
        |table: &toml::Table, page: &dyn Fn(&toml::Table) -> Option<Vec<String>>| {
            let document = serde_json::to_value(table).unwrap();
            let mut text_places = Vec::new();
            places(&document, &[], &mut text_places);
            let numbers = (0..text_places.len()).map(|index| index.to_string());
            let tried = try_all(numbers, &|number, more| {
                let place = &text_places[number.parse::<usize>().unwrap()];
                let changed = lengthened(&document, place, more);
                page(&serde_json::from_value(changed).unwrap())
            });
            let at = |text: &String| text_places[text.parse::<usize>().unwrap()].way.join("/");
            tried.accepted.iter().map(at).collect::<Vec<_>>()
        };
    let text = toml::to_string(&wearer).unwrap();
    let accepted = accepted_paths(&session, &|session| page_of(session, &text));
    println!("of the session: {accepted:?}");
    for wanted in ["title", "channel/0/name"] {
        assert!(accepted.iter().any(|path| path == wanted), "{wanted}");
    }
    let accepted = accepted_paths(&wearer, &|wearer| {
        page_of(&session, &toml::to_string(wearer).unwrap())
    });
    println!("of the wearer file: {accepted:?}");
    assert!(accepted.iter().any(|path| path == "source"));
}

/// Every page has a policy that lets a browser run nothing and request nothing, but use the page's
/// own style.
#[test]
fn every_page_says_what_a_browser_may_do() {
    let dir = full_record(&test_folder("page_policy"));
    for page in pages(&dir, "two").unwrap() {
        let (head, body) = page.split_once("</head>").unwrap();
        let policy = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
                      style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'\">";
        let at = head.find(policy).expect("a policy");
        assert!(at < head.find("<title>").unwrap() && at < head.find("<style>").unwrap());
        for part in ["<script", "<img", "<link", "url(", " src=", " on"] {
            let is = |part: &str| parts(body).iter().any(|text| text.contains(part));
            assert!(
                !head.contains(part) && !is(part.trim_start_matches('<')),
                "{part}"
            );
        }
    }
}
