//! Rule that every file belongs to a program: a file that no other file names is not compiled, and
//! its tests are lost without a message. A module with submodules is a folder with a `mod.rs`,
//! never a file beside its folder.

use super::Findings;
use super::source::Source;

/// Returns Rust files in a package's `src` and `tests` that belong to no program.
pub(super) fn orphan_files(sources: &[Source]) -> Findings {
    let mut found = Findings::new();
    for source in sources {
        let Some((folder, name)) = module(&source.path) else {
            continue;
        };
        let parents = ["/lib", "/main", "/suite", "/mod"];
        let parents = parents.map(|file| format!("{folder}{file}.rs"));
        let names = |parent: &Source| parents.contains(&parent.path) && declares(parent, name);
        if !sources.iter().any(names) {
            let file = &source.path;
            found.push(format!("{file}: no `mod {name};` in {folder}/mod.rs"));
        }
    }
    found
}

/// Returns the folder of the parent program or module, and the module's name; `None` for files that
/// need no declaration: programs, and files outside a package's `src` and `tests`.
fn module(path: &str) -> Option<(&str, &str)> {
    let file = path.strip_suffix(".rs")?;
    let mut parts = file.split('/').skip(1);
    let place = parts.next()?;
    let is_direct = parts.count() == 1;
    let file = file.strip_suffix("/mod").unwrap_or(file);
    let (folder, name) = file.rsplit_once('/')?;
    let is_program = match place {
        "src" => is_direct && matches!(name, "lib" | "main") || folder.ends_with("/src/bin"),
        "tests" => is_direct && name == "suite",
        _ => true,
    };
    (!is_program).then_some((folder, name))
}

fn declares(parent: &Source, name: &str) -> bool {
    let declaration = format!("mod {name};");
    let mut lines = parent.code.lines().map(str::trim);
    lines.any(|line| {
        let before = line.strip_suffix(&declaration);
        before.is_some_and(|before| before.is_empty() || before.ends_with(' '))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lost_of(files: &[(&str, &str)]) -> Vec<String> {
        let source = |(path, text): &(&str, &str)| Source::new(path, (*text).to_owned());
        let found = orphan_files(&files.iter().map(source).collect::<Vec<_>>());
        let file = |finding: String| finding.split(':').next().unwrap_or("").to_owned();
        found.into_iter().map(file).collect()
    }

    #[test]
    fn a_test_that_its_suite_does_not_name_is_lost() {
        let suite = ("a/tests/suite.rs", "mod listed;\nmod room;\n// mod lost;\n");
        let files = [
            suite,
            ("a/tests/listed.rs", ""),
            ("a/tests/lost.rs", ""),
            ("a/tests/room/mod.rs", "mod inner;"),
            ("a/tests/room/inner.rs", ""),
            ("a/tests/room/forgotten.rs", ""),
            ("a/tests/snapshots/x.snap", ""),
        ];
        let lost = ["a/tests/lost.rs", "a/tests/room/forgotten.rs"];
        assert_eq!(lost_of(&files), lost);
        let without_suite = [("tests/tests/x.rs", ""), ("a/tests/suite.rs", "mod x;")];
        assert_eq!(lost_of(&without_suite), ["tests/tests/x.rs"]);
    }

    #[test]
    fn a_source_file_belongs_to_the_room_above_it() {
        let files = [
            (
                "a/src/lib.rs",
                "pub mod b;\nmod e;\n#[cfg(test)]\nmod tests;",
            ),
            ("a/src/main.rs", ""),
            ("a/src/bin/tool.rs", ""),
            ("a/src/tests.rs", ""),
            ("a/src/b/mod.rs", "pub(crate) mod c;\nmod submod d;"),
            ("a/src/b/c.rs", ""),
            ("a/src/b/main.rs", ""),
            ("a/src/e.rs", "mod f;"),
            ("a/src/e/f.rs", ""),
            ("a/build.rs", ""),
            ("tests/fuzz/fuzz_targets/x.rs", ""),
        ];
        assert_eq!(lost_of(&files), ["a/src/b/main.rs", "a/src/e/f.rs"]);
    }
}
