//! One muscle under several electrodes.
use studies::distributed::{Declared, Person, play};
#[test]
fn tried() {
    let declared = Declared::own().unwrap();
    for index in 0..4 {
        let person = Person::drawn(&declared, 1, index);
        println!("{:?}", person.drawn);
        for condition in &declared.conditions {
            let begin = std::time::Instant::now();
            let it = play(&declared, condition, &person).unwrap();
            println!("{:20} {:?} refused {} ripple {:?} left {:?} first {:?} dist {:?} windows {} in {:?}", condition.id, it.endurance(), it.is_refused, it.ripple(), it.left(), it.first(), it.distance(), it.windows.len(), begin.elapsed());
        }
    }
}
