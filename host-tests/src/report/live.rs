//! Scans and poses over a WebSocket, for Foxglove and Lichtblick, while the robot drives. Needs the feature `foxglove`.

/// Where a [`Server`] listens unless it is told.
pub const ADDRESS: &str = "127.0.0.1:8765";

#[cfg(feature = "foxglove")]
pub use with::Server;
#[cfg(not(feature = "foxglove"))]
pub use without::Server;

#[cfg(feature = "foxglove")]
mod with {
    use std::sync::Arc;
    use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

    use anyhow::{Context as _, Result};
    use beamfix::geometry::{Point, Pose};
    use foxglove::{Context, PartialMetadata, RawChannel, Schema, WebSocketServerHandle};
    use serde_json::Value;

    use crate::report::foxglove::{self as messages, Kind};

    /// What is seen of the room is sent again after so long: it is much.
    const SEEN_EVERY: Duration = Duration::from_secs(3);

    /// A server that viewers connect to.
    pub struct Server {
        /// Its channels end with it.
        _context: Arc<Context>,
        handle: WebSocketServerHandle,
        points: Arc<RawChannel>,
        seen: Arc<RawChannel>,
        estimate: Arc<RawChannel>,
        transforms: Arc<RawChannel>,
        seen_last: Option<Instant>,
    }

    impl Server {
        /// Listens at `HOST:PORT`; port 0 is any that is free.
        pub fn start(address: &str) -> Result<Self> {
            let failed = || format!("--foxglove={address}");
            let (host, port) = address
                .rsplit_once(':')
                .context("no HOST:PORT")
                .with_context(failed)?;
            let port = port.parse().with_context(failed)?;
            let context = Context::new();
            let channel = |topic: &str, kind: Kind| {
                let schema = kind.schema().to_string().into_bytes();
                context
                    .channel_builder(topic)
                    .message_encoding(messages::MESSAGE)
                    .schema(Schema::new(kind.name(), messages::SCHEMA, schema))
                    .build_raw()
            };
            Ok(Self {
                points: channel("/points", Kind::Cloud)?,
                seen: channel("/seen", Kind::Cloud)?,
                estimate: channel("/pose/estimate", Kind::Pose)?,
                transforms: channel("/tf", Kind::Transform)?,
                seen_last: None,
                handle: context
                    .websocket_server()
                    .name("beamfix")
                    .bind(host, port)
                    .start_blocking()
                    .with_context(failed)?,
                _context: context,
            })
        }

        /// The port at which it listens.
        #[must_use]
        pub fn port(&self) -> u16 {
            self.handle.port()
        }

        /// Sends a scan's points in the robot's frame, and where the robot is.
        pub fn scan(&self, points: &[Point], pose: Pose) {
            let now = now();
            send(&self.points, now, || messages::cloud(seconds(now), points));
            send(&self.estimate, now, || messages::pose(seconds(now), pose));
            send(&self.transforms, now, || {
                messages::transform(seconds(now), pose)
            });
        }

        /// Sends what was seen so far (m), every few seconds.
        pub fn seen(&mut self, places: &[[f64; 2]]) {
            if self
                .seen_last
                .is_some_and(|last| last.elapsed() < SEEN_EVERY)
            {
                return;
            }
            self.seen_last = Some(Instant::now());
            let now = now();
            send(&self.seen, now, || {
                let points: Vec<Point> = places
                    .iter()
                    .map(|&[x, y]| Point::new(x as f32, y as f32))
                    .collect();
                messages::cloud_in_map(seconds(now), &points)
            });
        }
    }

    /// Makes and sends a message, where somebody wants it.
    fn send(channel: &RawChannel, now: Duration, message: impl FnOnce() -> Value) {
        if channel.has_sinks() {
            let meta = PartialMetadata::with_log_time(now.as_nanos() as u64);
            channel.log_with_meta(message().to_string().as_bytes(), meta);
        }
    }

    fn now() -> Duration {
        SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default()
    }

    fn seconds(time: Duration) -> f64 {
        time.as_secs_f64()
    }
}

#[cfg(not(feature = "foxglove"))]
mod without {
    use anyhow::{Result, bail};
    use beamfix::geometry::{Point, Pose};

    /// There is none in this build.
    pub enum Server {}

    impl Server {
        /// Tells how a tool with a server is built.
        pub fn start(_address: &str) -> Result<Self> {
            bail!(
                "--foxglove: not in this build; with it: cargo run --release --features host-tests/foxglove -- …"
            )
        }

        /// The port at which it listens.
        #[must_use]
        pub fn port(&self) -> u16 {
            match *self {}
        }

        /// Sends a scan's points in the robot's frame, and where the robot is.
        pub fn scan(&self, _points: &[Point], _pose: Pose) {
            match *self {}
        }

        /// Sends what was seen so far (m), every few seconds.
        pub fn seen(&mut self, _places: &[[f64; 2]]) {
            match *self {}
        }
    }
}
