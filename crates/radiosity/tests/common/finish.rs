use radiosity::session::Session;
use std::time::Duration;

/// Works on a session until nothing is left to do.
pub fn finish(session: &mut Session) {
    for _ in 0..100_000 {
        if session.step(Duration::from_millis(3)).is_done {
            return;
        }
    }
    panic!("{:?}", session.status());
}
