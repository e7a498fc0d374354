//! Spans: what was done, from when to when, and below what.

use std::{
    borrow::Cow,
    time::{Duration, Instant, SystemTime},
};

use jiff::Timestamp;
use opentelemetry::{
    Context, KeyValue, Value,
    trace::{Span as _, SpanBuilder, SpanKind, Status, TraceContextExt, Tracer},
};
use opentelemetry_sdk::trace::Span as SdkSpan;

use super::{TraceContext, export::tracer};

/// A span that has begun; ends when it is dropped. Nothing where traces are off.
#[derive(Debug, Default)]
pub struct Span(Option<Box<Begun>>);

#[derive(Debug)]
struct Begun {
    span: SdkSpan,
    /// The same point in time on both clocks.
    began: (SystemTime, Instant),
}

impl Span {
    /// Answering a request of that method and route, which came at `began` (semantic conventions of HTTP servers).
    #[must_use]
    pub fn of_request(method: &'static str, route: &str, parent: Option<&TraceContext>, began: Instant) -> Self {
        let mut span = Self::begin(SpanKind::Server, || format!("{method} {route}").into(), parent, began);
        span.note("http.request.method", || method);
        span.note("http.route", || route.to_owned());
        span
    }

    /// Doing since `began` what a span in another process or at another time has asked for.
    #[must_use]
    pub fn of_work(name: &'static str, parent: Option<&TraceContext>, began: Instant) -> Self {
        Self::begin(SpanKind::Consumer, || name.into(), parent, began)
    }

    fn begin(
        kind: SpanKind,
        name: impl FnOnce() -> Cow<'static, str>,
        parent: Option<&TraceContext>,
        began: Instant,
    ) -> Self {
        let Some(tracer) = tracer() else { return Self(None) };
        let began = (now() - began.elapsed(), began);
        let builder = SpanBuilder::from_name(name()).with_kind(kind).with_start_time(began.0);
        let parent = parent.map_or_else(Context::new, TraceContext::parent);
        Self(Some(Box::new(Begun { span: tracer.build_with_context(builder, &parent), began })))
    }

    /// Notes a fact. What it is is made only where somebody hears of it.
    pub fn note<V: Into<Value>>(&mut self, key: &'static str, fact: impl FnOnce() -> V) {
        if let Some(begun) = &mut self.0 {
            begun.span.set_attribute(KeyValue::new(key, fact()));
        }
    }

    /// Notes that it failed, by a code of a closed set.
    pub fn fail(&mut self, code: &str) {
        if let Some(begun) = &mut self.0 {
            begun.span.set_attribute(KeyValue::new("error.type", code.to_owned()));
            begun.span.set_status(Status::error(code.to_owned()));
        }
    }

    /// What others know it by, to be its children.
    #[must_use]
    pub fn context(&self) -> Option<TraceContext> {
        TraceContext::known(self.0.as_ref()?.span.span_context().clone())
    }

    /// Adds a part of it that is over: when it began, and how long it took. Gives what its own parts are added to.
    pub fn add_part(&self, name: &'static str, from: Instant, took: Duration) -> Part {
        let Some(begun) = &self.0 else { return Part(None) };
        let parent = Context::new().with_remote_span_context(begun.span.span_context().clone());
        let (then, at) = begun.began;
        let start = if from >= at { then + (from - at) } else { then - (at - from) };
        Part::record(name, &parent, (start, start + took))
    }
}

/// A span that is over.
#[derive(Debug)]
pub struct Part(Option<(Context, SystemTime)>);

impl Part {
    /// A part of that span between two points in time.
    pub fn between(name: &'static str, parent: Option<&TraceContext>, (from, to): (Timestamp, Timestamp)) {
        if let Some(parent) = parent.filter(|_| tracer().is_some()) {
            Self::record(name, &parent.parent(), (from.into(), to.max(from).into()));
        }
    }

    /// Adds parts of it that followed one another from its start.
    pub fn add_parts(&self, parts: impl IntoIterator<Item = (&'static str, Duration)>) {
        let Some((parent, start)) = &self.0 else { return };
        let mut from = *start;
        for (name, took) in parts {
            Self::record(name, parent, (from, from + took));
            from += took;
        }
    }

    fn record(name: &'static str, parent: &Context, (from, to): (SystemTime, SystemTime)) -> Self {
        let Some(tracer) = tracer() else { return Self(None) };
        let builder = SpanBuilder::from_name(name).with_kind(SpanKind::Internal).with_start_time(from);
        let mut span = tracer.build_with_context(builder, parent);
        span.end_with_timestamp(to);
        Self(Some((Context::new().with_remote_span_context(span.span_context().clone()), from)))
    }
}

/// The machine's own time, which spans of all machines are laid side by side by. No test moves it.
#[expect(clippy::disallowed_methods, reason = "spans tell when something was, and decide nothing")]
fn now() -> SystemTime {
    SystemTime::now()
}
