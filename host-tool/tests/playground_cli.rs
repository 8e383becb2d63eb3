//! `flexor playground` finds the page of a checkout or of a release, or says how to get it.

use std::path::Path;
use std::process::{Command, Output};

/// Copies the program into a new folder, so that nothing but the test lies beside it.
fn program_in(folder: &Path) -> std::path::PathBuf {
    let _ = std::fs::remove_dir_all(folder);
    std::fs::create_dir_all(folder).unwrap();
    let program = folder.join("flexor");
    std::fs::copy(env!("CARGO_BIN_EXE_flexor"), &program).unwrap();
    program
}

fn run(program: &Path, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).output().unwrap()
}

#[test]
fn the_page_is_found_beside_the_program_or_in_the_book() {
    let folder = std::env::temp_dir().join(format!("flexor-playground-{}", std::process::id()));
    let program = program_in(&folder);
    let missing = run(&program, &["playground", "--path"]);
    assert_eq!(missing.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&missing.stderr).contains("E579"));
    for place in ["book/playground", "flexor-web"] {
        let page = folder.join(place).join("playground.html");
        std::fs::create_dir_all(page.parent().unwrap()).unwrap();
        std::fs::write(&page, "page").unwrap();
        let found = run(&program, &["playground", "--path"]);
        assert!(found.status.success());
        assert_eq!(
            String::from_utf8_lossy(&found.stdout).trim(),
            page.display().to_string()
        );
        let json = run(&program, &["playground", "--json"]);
        let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
        assert_eq!(json["page"].as_str(), page.to_str());
    }
    // Without a screen there is nothing that opens the page.
    let mut alone = Command::new(&program);
    let opened = alone.arg("playground").env_clear().output().unwrap();
    assert_eq!(opened.status.code(), Some(1));
    let told = String::from_utf8_lossy(&opened.stderr).into_owned();
    assert!(
        told.contains("E574") && told.contains("playground.html"),
        "{told}"
    );
    std::fs::remove_dir_all(&folder).unwrap();
}
