//! The open sessions: which of them a new client may replace, when a call ends before its time, and whose turn it is to compute.

use std::net::{IpAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::error::{ConnectionEnd, Refusal};
use crate::stop::{Stopped, until};

/// Most connections at a time. Each may hold the scenes that it uses on the device.
pub(crate) const MOST_SESSIONS: usize = 16;
/// Sessions that compute at a time: while one waits for the device, the other prepares its next step.
const AT_ONCE: usize = 2;
/// How long a session computes before it lets another one go first.
const TURN: Duration = Duration::from_millis(100);
/// How often a session that waits for its turn looks whether it is still wanted.
const LOOK: Duration = Duration::from_millis(50);

/// Why a call or a session was ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ended {
    ServerStops,
    ClientLeft,
    TookTooLong,
    GaveWay,
}

/// What a session does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doing {
    /// It waits for its client since a time.
    Waiting(Instant),
    /// It works on a call until a time at most.
    Working(Instant),
}

#[derive(Debug)]
struct SessionState {
    doing: Doing,
    ended: Option<Ended>,
    /// Time that it has computed. A new session begins with the least time of all.
    computed: Duration,
    /// Whether it waits for its turn.
    waits: bool,
}

/// A session, as its own thread and the server see it.
pub(crate) struct Session {
    address: IpAddr,
    /// A second handle of the connection, which tells whether the client is there.
    stream: TcpStream,
    /// Ends the call under way.
    cancel: Arc<AtomicBool>,
    state: Mutex<SessionState>,
    all: Arc<Sessions>,
}

/// All sessions of a server.
#[derive(Default)]
pub(crate) struct Sessions {
    open: Mutex<Vec<Arc<Session>>>,
    /// Number of sessions that compute.
    computing: Mutex<usize>,
    changed: Condvar,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Sessions {
    /// Takes a new client. Where all places are taken, an idle session gives way: of the address that has most sessions, the one that has been idle
    /// longest. `None` if none of these has been idle for as long as `spare`.
    ///
    /// # Errors
    /// The system refuses a second handle of the connection.
    pub(crate) fn admit(
        self: &Arc<Self>,
        stream: &TcpStream,
        address: IpAddr,
        spare: Duration,
    ) -> std::io::Result<Option<Arc<Session>>> {
        let stream = stream.try_clone()?;
        let mut open = locked(&self.open);
        let staying = || open.iter().filter(|session| locked(&session.state).ended != Some(Ended::GaveWay));
        if staying().count() >= MOST_SESSIONS {
            let count = |address| staying().filter(|session| session.address == address).count();
            let most = staying().map(|session| count(session.address)).max().unwrap_or_default();
            let idle = staying().filter(|session| count(session.address) == most);
            let idle = idle.filter_map(|session| Some((session.idle()?, session)));
            match idle.max_by_key(|(idle, _)| *idle) {
                Some((idle, session)) if idle >= spare => session.end(Ended::GaveWay),
                _ => return Ok(None),
            }
        }
        let computed = open.iter().map(|session| locked(&session.state).computed).min().unwrap_or_default();
        let state = SessionState { doing: Doing::Waiting(Instant::now()), ended: None, computed, waits: false };
        let (cancel, state, all) = (Arc::default(), Mutex::new(state), Arc::clone(self));
        let session = Arc::new(Session { address, stream, cancel, state, all });
        open.push(Arc::clone(&session));
        Ok(Some(session))
    }

    /// Forgets a session that has ended.
    pub(crate) fn leave(&self, session: &Arc<Session>) {
        locked(&self.open).retain(|other| !Arc::ptr_eq(other, session));
    }

    /// Ends calls that take too long, and calls for which no client waits any more. All calls end where the server stops.
    pub(crate) fn look(&self, stops: bool) {
        for session in locked(&self.open).iter() {
            let doing = locked(&session.state).doing;
            match doing {
                _ if stops => session.end(Ended::ServerStops),
                Doing::Working(until) if Instant::now() > until => session.end(Ended::TookTooLong),
                Doing::Working(_) if has_left(&session.stream) => session.end(Ended::ClientLeft),
                _ => {}
            }
        }
    }

    /// Whether a session with less time behind it waits too.
    fn goes_first(&self, session: &Session) -> bool {
        let computed = locked(&session.state).computed;
        let before = |other: &Arc<Session>| {
            let state = locked(&other.state);
            state.waits && state.computed < computed
        };
        !locked(&self.open).iter().any(before)
    }

    fn someone_waits(&self) -> bool {
        locked(&self.open).iter().any(|session| locked(&session.state).waits)
    }
}

impl Session {
    fn idle(&self) -> Option<Duration> {
        match locked(&self.state).doing {
            Doing::Waiting(since) => Some(since.elapsed()),
            Doing::Working(_) => None,
        }
    }

    fn end(&self, why: Ended) {
        locked(&self.state).ended.get_or_insert(why);
        self.cancel.store(true, Ordering::Relaxed);
    }

    /// Ends the call under way as soon as it is set.
    pub(crate) fn cancel(&self) -> &AtomicBool {
        &self.cancel
    }

    /// Does the work of a call until the call is ended.
    ///
    /// # Errors
    /// The call was ended.
    pub(crate) fn until_ended<T>(&self, work: impl FnOnce() -> T) -> Result<T, Refusal> {
        until(&self.cancel, work).map_err(|Stopped| Refusal::Stopped)
    }

    /// Why the session must end, if it must.
    pub(crate) fn verdict(&self) -> Option<ConnectionEnd> {
        match locked(&self.state).ended? {
            Ended::ServerStops => Some(ConnectionEnd::Stopped),
            Ended::ClientLeft => Some(ConnectionEnd::Closed),
            Ended::GaveWay => Some(ConnectionEnd::GaveWay),
            Ended::TookTooLong => None,
        }
    }

    /// Begins a call of the client, which may take some time.
    pub(crate) fn begin_call(&self, longest: Duration) {
        locked(&self.state).doing = Doing::Working(Instant::now() + longest);
    }

    /// Ends a call. After a call that took too long, the session goes on with the next one.
    pub(crate) fn end_call(&self) {
        let mut state = locked(&self.state);
        state.doing = Doing::Waiting(Instant::now());
        if state.ended == Some(Ended::TookTooLong) {
            state.ended = None;
            self.cancel.store(false, Ordering::Relaxed);
        }
    }

    /// Waits for the turn to compute. The session that has computed least goes first.
    ///
    /// # Errors
    /// The call was ended.
    pub(crate) fn turn(&self) -> Result<Turn<'_>, Refusal> {
        let mut turn = Turn { session: self, since: None };
        turn.wait();
        if self.cancel.load(Ordering::Relaxed) { Err(Refusal::Stopped) } else { Ok(turn) }
    }
}

/// The turn of a session to compute. The end of its life ends the turn.
pub(crate) struct Turn<'s> {
    session: &'s Session,
    since: Option<Instant>,
}

impl Turn<'_> {
    fn wait(&mut self) {
        let all = &self.session.all;
        locked(&self.session.state).waits = true;
        let mut computing = locked(&all.computing);
        while !self.session.cancel.load(Ordering::Relaxed) {
            if *computing < AT_ONCE && all.goes_first(self.session) {
                *computing += 1;
                self.since = Some(Instant::now());
                break;
            }
            (computing, _) = all.changed.wait_timeout(computing, LOOK).unwrap_or_else(PoisonError::into_inner);
        }
        locked(&self.session.state).waits = false;
        drop(computing);
        // A place that is still free is for the next in line.
        all.changed.notify_all();
    }

    fn end(&mut self) {
        if let Some(since) = self.since.take() {
            locked(&self.session.state).computed += since.elapsed();
            *locked(&self.session.all.computing) -= 1;
            self.session.all.changed.notify_all();
        }
    }

    /// Lets others go first, where the turn is over and others wait.
    pub(crate) fn pass_on(&mut self) {
        if self.since.is_some_and(|since| since.elapsed() > TURN) && self.session.all.someone_waits() {
            self.end();
            self.wait();
        }
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        self.end();
    }
}

/// Whether a client has closed its connection, or its sending half. Requests that still wait do not hide it.
#[cfg(target_os = "linux")]
fn has_left(stream: &TcpStream) -> bool {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let mut fds = [PollFd::new(stream, PollFlags::RDHUP)];
    let gone = PollFlags::RDHUP | PollFlags::HUP | PollFlags::ERR;
    poll(&mut fds, Some(&Timespec::default())).is_ok_and(|count| count > 0) && fds[0].revents().intersects(gone)
}

/// Other systems tell it at the next read.
#[cfg(not(target_os = "linux"))]
fn has_left(_stream: &TcpStream) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, TcpListener};

    use super::*;

    /// Connections of one machine, and the addresses that they are taken to have.
    fn connections(count: usize) -> Vec<TcpStream> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
        let address = listener.local_addr().expect("its address");
        (0..count).map(|_| TcpStream::connect(address).expect("a connection")).collect()
    }

    #[test]
    fn the_address_with_most_sessions_gives_way() {
        let all = Arc::new(Sessions::default());
        let streams = connections(MOST_SESSIONS + 3);
        let [many, few] = [1, 2].map(|last| IpAddr::V4(Ipv4Addr::new(127, 0, 0, last)));
        let admit = |number: usize, address, spare| {
            all.admit(&streams[number], address, Duration::from_millis(spare)).expect("a handle")
        };
        let first = admit(0, few, 0).expect("a place");
        let busy = admit(1, many, 0).expect("a place");
        busy.begin_call(Duration::from_secs(60));
        let rest: Vec<_> = (2..MOST_SESSIONS).map(|number| admit(number, many, 0).expect("a place")).collect();
        assert!(admit(MOST_SESSIONS, few, 60_000).is_none(), "none has been idle for a minute");
        assert!(admit(MOST_SESSIONS, few, 0).is_some());
        let ended = |session: &Session| matches!(session.verdict(), Some(ConnectionEnd::GaveWay));
        assert!(ended(&rest[0]), "the one of the address with most that has been idle longest");
        assert!(!ended(&first) && !ended(&busy) && !rest[1..].iter().any(|session| ended(session)));
    }

    #[test]
    fn who_has_computed_least_goes_first() {
        let all = Arc::new(Sessions::default());
        let streams = connections(4);
        let spare = Duration::ZERO;
        let admit = |stream| all.admit(stream, IpAddr::V4(Ipv4Addr::LOCALHOST), spare).expect("one").expect("one");
        let sessions: Vec<_> = streams.iter().map(admit).collect();
        locked(&sessions[2].state).computed = Duration::from_secs(5);
        let held = [sessions[0].turn().expect("a turn"), sessions[1].turn().expect("a turn")];
        let order = Mutex::new(Vec::new());
        std::thread::scope(|threads| {
            for number in [2, 3] {
                let (order, session) = (&order, &sessions[number]);
                threads.spawn(move || {
                    let turn = session.turn();
                    locked(order).push((number, turn.is_ok()));
                    std::thread::sleep(Duration::from_millis(300));
                });
                while !locked(&session.state).waits {
                    std::thread::yield_now();
                }
            }
            let [one, other] = held;
            drop(one);
            while locked(&order).is_empty() {
                std::thread::yield_now();
            }
            assert_eq!(*locked(&order), [(3, true)], "the later one has computed less");
            sessions[2].end(Ended::ClientLeft);
            while locked(&order).len() < 2 {
                std::thread::yield_now();
            }
            assert_eq!(locked(&order)[1], (2, false), "a call that was ended gets no turn");
            drop(other);
        });
        assert_eq!(*locked(&all.computing), 0);
    }

    #[test]
    fn a_call_ends_with_its_time_and_the_session_goes_on() {
        let all = Arc::new(Sessions::default());
        let streams = connections(1);
        let session =
            all.admit(&streams[0], IpAddr::V4(Ipv4Addr::LOCALHOST), Duration::ZERO).expect("one").expect("one");
        session.begin_call(Duration::from_secs(60));
        all.look(false);
        // The listener of the test is gone, and with it the other end.
        assert!(cfg!(not(target_os = "linux")) || matches!(session.verdict(), Some(ConnectionEnd::Closed)));
        let late = Session {
            address: session.address,
            stream: streams[0].try_clone().expect("a handle"),
            cancel: Arc::default(),
            state: Mutex::new(SessionState {
                doing: Doing::Working(Instant::now()),
                ended: None,
                computed: Duration::ZERO,
                waits: false,
            }),
            all: Arc::clone(&all),
        };
        late.end(Ended::TookTooLong);
        assert!(late.turn().is_err() && late.verdict().is_none());
        late.end_call();
        assert!(late.turn().is_ok() && late.idle().is_some());
    }
}
