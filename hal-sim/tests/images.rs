//! Places where images are searched, and the error when there is none.

use hal_sim::images::{self, BuildError, Image, Places};
use std::path::{Path, PathBuf};

/// Creates an empty folder for this test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("images")
        .join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Finds an image, and panics if anything is built.
fn find(image: Image, places: &Places) -> Result<PathBuf, BuildError> {
    image.find(places, &mut |line| panic!("built: {line}"))
}

#[test]
fn an_image_beside_the_program_is_taken_as_it_is() {
    let program = folder("beside");
    std::fs::create_dir(program.join("flexor-images")).unwrap();
    let places = Places {
        checkout: Some(Path::new(env!("CARGO_MANIFEST_DIR")).join("..")),
        program: Some(program.clone()),
    };
    for name in ["stimulator", "qemu", "coremark"] {
        std::fs::write(program.join("flexor-images").join(name), name).unwrap();
    }
    for (image, name) in [(Image::Stimulator, "stimulator"), (Image::Qemu, "qemu")] {
        let path = find(image, &places).unwrap();
        assert_eq!(path, program.join("flexor-images").join(name));
    }
    let path = images::find_coremark(&places, &mut |line| panic!("built: {line}")).unwrap();
    assert_eq!(path, program.join("flexor-images/coremark"));
}

#[test]
fn a_program_away_from_its_checkout_says_where_the_image_belongs() {
    let program = folder("away");
    // A folder that was a checkout, a missing folder, and none.
    for checkout in [Some(folder("emptied")), Some(program.join("gone")), None] {
        let places = Places {
            program: Some(program.clone()),
            checkout,
        };
        let error = find(Image::Stimulator, &places).unwrap_err();
        assert!(matches!(error, BuildError::Nowhere { .. }), "{error:?}");
        let text = error.to_string();
        let wanted = program.join("flexor-images/stimulator");
        assert!(text.contains(&wanted.display().to_string()), "{text}");
        assert!(
            text.contains("FLEXOR_CHECKOUT") && !text.contains('\n'),
            "{text}"
        );
    }
}

/// A checkout whose firmware does not compile: cargo's messages arrive line by line, and the error
/// contains all of them.
#[test]
fn a_build_is_heard_and_its_failure_told() {
    let checkout = folder("broken");
    std::fs::create_dir(checkout.join("firmware")).unwrap();
    std::fs::write(checkout.join("firmware/Cargo.toml"), "[package\n").unwrap();
    std::fs::write(
        checkout.join("Cargo.toml"),
        "[workspace]\nmembers = [\"firmware\"]\n",
    )
    .unwrap();
    let places = Places {
        program: None,
        checkout: Some(checkout),
    };
    let mut heard = Vec::new();
    let found = Image::Bench.find(&places, &mut |line| heard.push(line.to_owned()));
    let Err(BuildError::NotBuilt { image, words }) = found else {
        panic!("{found:?}")
    };
    assert_eq!(image, "bench");
    assert!(
        !heard.is_empty() && words.contains(&heard[0]),
        "{heard:?} {words}"
    );
}

/// Runs `cargo program` with only these commands, each a shell script, in PATH.
#[cfg(unix)]
fn program(test: &str, commands: &[(&str, &str)]) -> std::process::Output {
    use std::os::unix::fs::PermissionsExt;
    let path = folder(test);
    for (name, script) in commands {
        let file = path.join(name);
        std::fs::write(&file, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_program"));
    command.env("PATH", path).output().unwrap()
}

#[cfg(unix)]
#[test]
fn a_missing_probe_rs_is_reported_before_the_build() {
    for commands in [
        &[("cargo", "echo built >&2; exit 1")][..],
        &[("cargo", "echo built >&2; exit 1"), ("probe-rs", "exit 1")],
    ] {
        let done = program("no-probe-rs", commands);
        let text = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(1), "{text}");
        assert!(text.contains("cargo install probe-rs-tools"), "{text}");
        assert!(!text.contains("built"), "{text}");
    }
}

#[cfg(unix)]
#[test]
fn an_image_that_does_not_build_is_not_flashed() {
    let commands = [
        ("cargo", "echo 'error: no target' >&2; exit 101"),
        ("probe-rs", "[ $1 = --version ] || echo flashed >&2"),
    ];
    let done = program("not-built", &commands);
    let text = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(1), "{text}");
    assert!(text.contains("error: no target"), "{text}");
    assert!(!text.contains("flashed"), "{text}");
}
