//! A program that was copied away from its checkout says which image it needs and
//! where, in one line; with the image beside it, it takes that one.

use std::path::{Path, PathBuf};
use std::process::Command;

const FLEXOR: &str = env!("CARGO_BIN_EXE_flexor");
const SESSION: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/sessions/trigger.toml");

/// A copy of the program in an otherwise empty folder.
fn copied(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("copied")
        .join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let program = folder.join("flexor");
    if std::fs::hard_link(FLEXOR, &program).is_err() {
        std::fs::copy(FLEXOR, &program).unwrap();
    }
    folder
}

/// Its one line of error without a checkout.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(folder.join("flexor"));
    command
        .current_dir(folder)
        .args(arguments)
        .env("NO_COLOR", "1");
    command.env("FLEXOR_CHECKOUT", folder.join("no-checkout"));
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    println!("{text}");
    text
}

#[test]
fn without_checkout_each_command_names_the_image_and_its_place() {
    let folder = copied("away");
    for (number, image, arguments) in [
        (
            "E543",
            "stimulator",
            &["run", SESSION, "--device", "chip"][..],
        ),
        (
            "E543",
            "stimulator",
            &["serve", "--device", "chip", "--tcp", "127.0.0.1:0"],
        ),
        ("E543", "stimulator", &["profile", SESSION]),
        ("E543", "stimulator", &["selftest", "--device", "chip"]),
        ("E510", "qemu", &["run", SESSION, "--device", "qemu"]),
        ("E543", "bench", &["bench"]),
        ("E543", "methods", &["chart", "accuracy", "--out", "."]),
    ] {
        let error = refused(&folder, arguments);
        assert!(error.starts_with(&format!("error: {number} ")), "{error}");
        let place = folder.join("flexor-images").join(image);
        let place = place.canonicalize().unwrap_or(place);
        assert!(error.contains(&place.display().to_string()), "{error}");
        assert!(error.contains(&format!("release/{image}")), "{error}");
    }
}

#[test]
fn an_image_beside_the_program_is_the_one_taken() {
    let folder = copied("beside");
    std::fs::create_dir(folder.join("flexor-images")).unwrap();
    std::fs::write(folder.join("flexor-images/stimulator"), "no ELF").unwrap();
    let error = refused(&folder, &["run", SESSION, "--device", "chip"]);
    assert!(
        error.contains("E531") && error.contains("flexor-images/stimulator"),
        "{error}"
    );
}
