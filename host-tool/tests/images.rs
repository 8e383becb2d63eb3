//! A program copied out of its checkout reports in one line which image it needs and where; with
//! the image beside it, it uses that image.

use crate::program::{FLEXOR, TRIGGER, command_result, test_folder};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Copies the program into its own folder.
fn copied(test: &str) -> PathBuf {
    let folder = test_folder(&format!("copied/{test}"));
    let program = folder.join("flexor");
    if std::fs::hard_link(FLEXOR, &program).is_err() {
        std::fs::copy(FLEXOR, &program).unwrap();
    }
    folder
}

/// Returns the one line of error without a checkout.
fn expect_error(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(folder.join("flexor"));
    command.current_dir(folder).args(arguments);
    command.env("NO_COLOR", "1");
    command.env("FLEXOR_CHECKOUT", folder.join("no-checkout"));
    let (exit, _, text) = command_result(command.output().unwrap());
    assert_eq!(exit, Some(1), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    println!("{text}");
    text
}

#[test]
fn without_checkout_each_command_names_the_image_and_its_place() {
    let folder = copied("away");
    #[rustfmt::skip]
    let rows: [(&str, &str, &[&str]); 7] = [
        ("E543", "stimulator", &["run", TRIGGER, "--device", "chip"]),
        ("E543", "stimulator", &["serve", "--device", "chip", "--tcp", "127.0.0.1:0"]),
        ("E543", "stimulator", &["profile", TRIGGER]),
        ("E543", "stimulator", &["selftest", "--device", "chip"]),
        ("E510", "qemu", &["run", TRIGGER, "--device", "qemu"]),
        ("E543", "bench", &["bench"]),
        ("E543", "methods", &["chart", "accuracy", "--out", "."]),
    ];
    for (number, image, arguments) in rows {
        let error = expect_error(&folder, arguments);
        assert!(error.starts_with(&format!("error: {number} ")), "{error}");
        let place = folder.join("flexor-images").join(image);
        let place = place.canonicalize().unwrap_or(place);
        assert!(error.contains(&place.display().to_string()), "{error}");
        assert!(
            error.contains(&format!("flexor-images/{image} of a release")),
            "{error}"
        );
    }
}

#[test]
fn an_image_beside_the_program_is_the_one_taken() {
    let folder = copied("beside");
    std::fs::create_dir(folder.join("flexor-images")).unwrap();
    std::fs::write(folder.join("flexor-images/stimulator"), "no ELF").unwrap();
    let error = expect_error(&folder, &["run", TRIGGER, "--device", "chip"]);
    for part in ["E531", "flexor-images/stimulator"] {
        assert!(error.contains(part), "{error}");
    }
}
