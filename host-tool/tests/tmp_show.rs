use firmware::methods::muscle::*;
use host_tool::accuracy::{cases, errors};
#[test]
fn show() {
    let cases = cases::all();
    for output_us in [1000, 20_000] {
        for s in Setting::all(output_us) {
            if s.method == Method::LogFlow || s.method == Method::LogTable && s.step_us == 1000 {
                println!(
                    "{output_us} {s} {:.3e}",
                    errors::worst(&cases, s, output_us)
                );
            }
        }
    }
}
