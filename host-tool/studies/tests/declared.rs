//! Tests of the refusals of declarations, and of the differences that conditions may have.

use super::laboratory::{LimitedOperator, SMALL, folder, texts};
use host_core::run::DeviceName;
use host_core::session::BodySpec;
use host_core::wearer::builtin_wearer;
use studies::experiments::{load_experiment, names};
use studies::laboratory::{Experiment, LaboratoryError, Outcome};

/// Returns the reason why an experiment with this text is refused.
pub(crate) fn refusal(text: &str) -> String {
    let refused = Experiment::new("small.toml", text, &texts).unwrap_err();
    refused.to_string()
}

#[test]
fn a_level_that_changes_what_is_not_there_is_named() {
    let absent = SMALL.replace("\"wall.co_contraction\"", "\"wall.other\"");
    let error = refusal(&absent);
    for wanted in [
        "small.toml changes fields wrongly: line 12: level `pre-wall`: `wall.other` cannot be removed",
        "line 16: level `bare`: `wall.other`",
    ] {
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
}

#[test]
fn a_wearer_that_no_session_takes_is_blamed_on_its_draw_or_grid() {
    let limit = SMALL.replace("low = 0.6\nhigh = 2.4", "low = 600.0\nhigh = 601.0");
    let error = refusal(&limit);
    let wanted = "changes fields wrongly: line 22: draw `body.push_nm` = 600.";
    let is = error.starts_with("E602 ") && error.contains(wanted);
    assert!(is, "{error}");
    assert!(error.contains("in the condition `pre-wall`"), "{error}");
    // A misspelt field, a field of another body, and a field that does not exist.
    let typo = SMALL.replace("\"body.push_nm\"", "\"body.pusj_nm\"");
    let grid = "[[grid]]\nfield = \"body.second_point_nm\"\nvalues = [1.0, 2.0]\nsource = \"x\"\n\
                [[grid]]\nfield = \"channel.7.limit\"\nvalues = [1.0]\nsource = \"x\"\n";
    let error = refusal(&(typo + grid));
    for wanted in [
        "line 22: draw `body.pusj_nm` = ",
        "did you mean `push_nm`?",
        "line 40: grid `body.second_point_nm` = 1: E402",
        "line 44: grid `channel.7.limit` = 1: `channel.7.limit` cannot be set: no `channel`",
    ] {
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
}

#[test]
fn every_declaration_of_the_program_can_be_run() {
    for name in names() {
        let read = load_experiment(name).map(|experiment| experiment.asked);
        assert_eq!(read.map_err(|error| error.to_string()), Ok(name.to_owned()));
    }
}

/// A table that every level sets alike may contain a random field; where the levels differ, the
/// draw would make them alike.
#[test]
fn a_draw_into_a_table_of_the_levels_may_not_undo_what_they_differ_in() {
    let yields = |to: f64| {
        let table = format!("{{ delay_s = 0.1, to = {to:?}, at_ma = 20.0 }}");
        format!("\"body.yields\" = {table}, \"body.start_deg\"")
    };
    let draw = "[[draw]]\nfield = \"body.yields.to\"\nlow = 0.3\nhigh = 0.8\nsource = \"x\"\n";
    let drawn = SMALL.to_owned() + draw;
    let alike = drawn.replace("\"body.start_deg\"", &yields(0.5));
    Experiment::new("small.toml", &alike, &texts).unwrap();
    let start = drawn.replacen("\"body.start_deg\"", &yields(0.5), 1);
    let (first, rest) = start.split_at(start.find("bare").unwrap());
    let differ = first.to_owned() + &rest.replacen("\"body.start_deg\"", &yields(0.7), 1);
    let error = refusal(&differ);
    let wanted = "changes `body.yields`, but the draw of `body.yields.to`";
    assert!(error.contains(wanted), "{error}");
}

#[test]
fn a_draw_or_grid_of_what_a_level_decides_is_refused() {
    // A field that a level sets, a table from which it removes a field, and a field in a table that
    // it sets.
    for (field, level) in [
        ("wall.co_contraction", "pre-wall"),
        ("wall", "pre-wall"),
        ("wall.co_contraction.lead_deg", "pre-wall"),
    ] {
        let more = format!("[[grid]]\nfield = \"{field}\"\nvalues = [1.0]\nsource = \"x\"\n");
        let error = refusal(&(SMALL.to_owned() + &more));
        let wanted =
            format!("level `{level}` changes `wall.co_contraction`, but the grid of `{field}`");
        let begins = "E600 the declaration small.toml has mistakes: ";
        assert!(error.starts_with(begins), "{error}");
        assert!(error.contains(&wanted), "{wanted}: {error}");
    }
    // Another field whose name only begins alike.
    let beside = "[[grid]]\nfield = \"wall.co_contraction_x\"\nvalues = [1.0]\nsource = \"x\"\n";
    let error = refusal(&(SMALL.to_owned() + beside));
    assert!(!error.contains("decides"), "{error}");
}

#[test]
fn both_ends_of_a_draw_are_tried_before_anything_runs() {
    // The first wearer of these seeds lies within the accepted ranges.
    for (range, end) in [
        ("low = 0.6\nhigh = 101.0", "101.0"),
        ("low = -0.5\nhigh = 2.4", "-0.5"),
    ] {
        let error = refusal(&SMALL.replace("low = 0.6\nhigh = 2.4", range));
        let wanted = format!("wrongly: line 22: draw `body.push_nm` = {end}");
        let is = error.starts_with("E602 ") && error.contains(&wanted);
        assert!(is, "{wanted}: {error}");
    }
}

/// Claims with one mistake each.
const WRONG_CLAIMS: &str = r#"
[[claim]]
id = "a"
says = "a"
measure = "depth"
factor = "wall"
this = "bare"
is = "less"
than = "bare"
by = -1.0
where = { sight = "blind" }
[[claim]]
id = "b"
says = "b"
measure = "charge_mc"
factor = "hall"
this = "bare"
all = ["a"]
[[claim]]
id = "c"
says = "c"
all = ["b", "e"]
none = ["c"]
[[claim]]
id = "d"
says = "d"
mesure = "charge_mc"
[[claim]]
id = "e"
says = "e"
measure = "charge_mc"
factor = "hall"
this = "bare"
is = "less"
than = "pre-wall"
where = { wall = "steep" }
"#;

#[test]
fn every_mistake_of_every_claim_is_told_with_its_line() {
    let bad = SMALL.replace("draws = 10", "drwas = 10");
    let lines = SMALL.matches('\n').count();
    let at = |line: usize, what: &str| format!("line {}: {what}", lines + line);
    let error = refusal(&format!("{SMALL}{WRONG_CLAIMS}"));
    for wanted in [
        at(
            5,
            "claim `a`: `depth` is not in the declaration's `measures`",
        ),
        at(9, "claim `a`: compares `bare` with itself"),
        at(10, "claim `a`: by is -1"),
        at(11, "claim `a`: no factor `sight`"),
        at(
            12,
            "claim `b` compares levels but lacks `is`, `than`, and also has `all` or `none`",
        ),
        at(22, "claim `c`: there is no claim `e` before this one"),
        at(23, "claim `c`: there is no claim `c` before this one"),
        at(27, "unknown field `mesure`"),
        at(32, "claim `e`: no factor `hall`"),
        at(36, "claim `e`: no level `steep` of `wall`"),
    ] {
        assert!(error.contains(&wanted), "{wanted}: {error}");
    }
    assert_eq!(error.matches("line ").count(), 10, "{error}");
    // A claim that could not be parsed is not reported as missing.
    assert!(!error.contains("no claim `b`"), "{error}");
    let both = refusal(&format!("{bad}{WRONG_CLAIMS}"));
    assert!(
        both.contains("`drwas`") && both.contains("`mesure`"),
        "{both}"
    );
}

#[test]
fn a_session_that_is_not_there_is_told_by_who_asks_for_it() {
    let level = "name = \"bare\"\nsession = \"nowhere.toml\"";
    let text = SMALL.replace("name = \"bare\"", level);
    let beside = |name: &str| match name {
        "wall.toml" | "../../wearers/harris-1.toml" => texts(name),
        other => Err(LaboratoryError::File(
            other.to_owned(),
            std::io::Error::other("gone"),
        )),
    };
    let error = Experiment::new("small.toml", &text, &beside);
    let error = error.unwrap_err().to_string();
    let wanted = "line 16: the session `nowhere.toml` of level `bare` of factor `wall`";
    let is = error.starts_with("E600 ") && error.contains(wanted);
    assert!(is, "{error}");
    assert!(error.contains("gone"), "{error}");
    // Each session and its wearer file are read once, however many conditions share them.
    let asked = std::cell::RefCell::new(Vec::new());
    let counted = |name: &str| {
        asked.borrow_mut().push(name.to_owned());
        texts(name)
    };
    Experiment::new("small.toml", SMALL, &counted).unwrap();
    assert_eq!(
        *asked.borrow(),
        ["wall.toml", "../../wearers/harris-1.toml"]
    );
}

/// An elbow at a wall and a finger that follows a reference: each has fields that the other lacks.
#[test]
fn conditions_may_have_different_bodies() {
    const FINGER: &str = include_str!("../../sessions/hamana_exp4_two_point_finger.toml");
    let both = |name: &str| match name {
        "finger.toml" => Ok(FINGER.to_owned()),
        other => texts(other),
    };
    let (head, _) = SMALL.split_once("[[draw]]").unwrap();
    let head = head.replace("\"charge_mc\"]", "\"rmse_deg\"]");
    let head = head.replace("unset = [\"wall.co_contraction\", \"wall.pre_wall\"]\n", "");
    let (head, _) = head.rsplit_once("set = ").unwrap();
    let finger = "session = \"finger.toml\"\nunset = [\"measure\"]\nset = { duration_s = 1.5 }\n";
    let claim = "[[claim]]\nid = \"a\"\nsays = \"a\"\nmeasure = \"deepest_deg\"\nfactor = \"wall\"\n\
                 this = \"pre-wall\"\nis = \"less\"\nthan = \"bare\"\n";
    let text = format!("{head}{finger}{claim}");
    let experiment = Experiment::new("bodies.toml", &text, &both).unwrap();
    let mut operator = LimitedOperator(9, Vec::new());
    let place = (&DeviceName::Native, 3);
    let course = experiment.conduct(&folder("bodies"), place, &mut operator);
    let outcome = Outcome::from_trials(
        &experiment,
        ("native", 3),
        &course.unwrap().trials,
        Some(true),
    );
    let known: Vec<usize> = outcome.rows.iter().map(|row| row.n).collect();
    assert_eq!(known, [1, 0, 0, 1], "{:?}", outcome.rows);
    for wanted in ["deepest_deg", "rmse_deg"] {
        let mut notes = outcome.notes.iter();
        let is_noted = notes.any(|note| note.starts_with(wanted) && note.contains("has no value"));
        assert!(is_noted, "{wanted}: {:?}", outcome.notes);
    }
    assert_eq!(outcome.shares[0].of, 0);
    let draw = "[[draw]]\nfield = \"body.push_nm\"\nlow = 0.6\nhigh = 2.4\nsource = \"assumed\"\n";
    let refused = Experiment::new("bodies.toml", &format!("{text}{draw}"), &both);
    let error = refused.unwrap_err().to_string();
    let wanted = "draw `body.push_nm` = ";
    assert!(
        error.contains(wanted) && error.contains("condition `bare`"),
        "{error}"
    );
}

/// Returns a wearer who is weaker and has lower thresholds than harris-1.
fn other() -> String {
    let text = builtin_wearer("harris-1").unwrap();
    let text = text.replace("name = \"harris-1\"", "name = \"X-1\"");
    let text = text.replace(
        "motor_threshold = 37.5\nlimit = 80\nminimum = 20\nmaximum = 80",
        "motor_threshold = 12\nlimit = 50",
    );
    text.replace("triceps = 1\n", "triceps = 1\ntriceps_nm = 3.5\n")
}

/// With another wearer file, the wall's amplitudes and the simulated arm are that wearer's, the
/// file's values are not random, and the record contains the file.
#[test]
fn a_declaration_is_played_on_another_wearer() {
    let declared = load_experiment("harris-wall").unwrap();
    let files = declared.hashes.iter().map(|(file, _)| &**file);
    assert!(files.clone().any(|file| file == "../wearers/harris-1.toml"));
    let whole = declared
        .clone()
        .with_wearer("x/X-1.toml", &other())
        .unwrap();
    let fields = |experiment: &Experiment| -> Vec<String> {
        experiment
            .declaration
            .drawn
            .iter()
            .map(|draw| draw.field.clone())
            .collect()
    };
    let gone: Vec<String> = fields(&declared)
        .into_iter()
        .filter(|field| !fields(&whole).contains(field))
        .collect();
    let known = ["triceps_threshold_ma", "triceps_nm", "biceps_threshold_ma"];
    assert_eq!(gone, known.map(|field| format!("body.{field}")));
    for file in whole.sessions(&[]).unwrap() {
        let session = file.session;
        let wall = session.wall.unwrap();
        assert_eq!(wall.max.get(), 50_000);
        if let Some(pre_wall) = wall.pre_wall {
            assert_eq!((pre_wall.begin.get(), pre_wall.end.get()), (12_000, 50_000));
        }
        assert_eq!(session.worn.unwrap().wearer.name, "X-1");
        let Some(BodySpec::Elbow(elbow)) = session.body else {
            panic!("no elbow");
        };
        let triceps = &elbow.triceps;
        assert_eq!((triceps.threshold_ma, triceps.torque_nm), (12.0, 3.5));
    }
    let dir = folder("declared_on_another");
    whole.save_files(&dir).unwrap();
    let again = Experiment::from_record(&dir, &whole.declared_files()).unwrap();
    assert_eq!((&again.hashes, &again.worn), (&whole.hashes, &whole.worn));
    let texts = |experiment: &Experiment| {
        experiment
            .sessions(&[])
            .unwrap()
            .into_iter()
            .map(|session_file| session_file.text)
            .collect::<Vec<_>>()
    };
    assert_eq!(texts(&again), texts(&whole));
    // Changed in the record: refused.
    let kept = whole.declared_files().len() - 1;
    let kept = dir.join(whole.declared_files()[kept].copy_path(kept));
    std::fs::write(kept, other().replace("3.5", "3.6")).unwrap();
    let error = Experiment::from_record(&dir, &whole.declared_files())
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("E613"), "{error}");
}

#[test]
fn a_wearer_who_does_not_fit_a_declaration_is_refused_by_name() {
    let refused = |name: &str, text: &str| {
        let error = load_experiment(name).unwrap().with_wearer("X.toml", text);
        error.unwrap_err().to_string()
    };
    let (bare, _) = other()
        .split_once("[elbow]")
        .map(|(a, b)| (a.to_owned(), b.to_owned()))
        .unwrap();
    for (name, text, wanted) in [
        (
            "harris-wall",
            bare,
            "E663 X.toml does not fit this experiment: the wearer file has no `[elbow]`",
        ),
        (
            "harris-wall",
            other()
                .replace("triceps = 1", "triceps = 2")
                .replace("biceps = 2", "biceps = 1"),
            "the wearer file has the triceps on channel 2",
        ),
        ("open-trains", other(), "names no wearer file"),
    ] {
        let error = refused(name, &text);
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
    // A wearer whose limits the declared wall exceeds at another pulse rate.
    let slow = other().replace("frequency_hz = 50.0", "frequency_hz = 30.0");
    assert!(refused("harris-wall", &slow).contains("E658"));
}
