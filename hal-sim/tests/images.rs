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
