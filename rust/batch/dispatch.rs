//! The choice of the CPU path: the one place where the features of the CPU are asked for.

use super::Job;
use super::job::MethodName;
use super::worker::{Shared, work};
use crate::model::{Base, Extended, ExtendedRigid, OneInertia, TwoInertia};
use crate::real::{Dual, Pair, Path, Real, Task};
#[cfg(target_arch = "x86_64")]
use crate::real::{F64x4, F64x8, compiled};
use crate::solve::{Bs3, Dop853, Dopri5, Method, Rodas5p, Tsit5};
use std::marker::PhantomData;

/// A CPU path by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SimdPath {
    /// x86-64 with AVX-512: two vectors of eight; one for models with terms, rodas5p and derivatives.
    Avx512,
    /// x86-64 with AVX2 and FMA: two vectors of four; one for rodas5p and derivatives.
    Avx2,
    /// One lane, with fused multiply-add where the CPU has it.
    Scalar,
    /// Four lanes of plain code, NEON on aarch64; one for models with terms, rodas5p and derivatives.
    Portable,
}

macro_rules! path {
    ($(#[$doc:meta])* $name:ident, $module:ident, $lanes:ty, $label:literal, [$($feature:tt),+]) => {
        compiled!($module, $($feature),+);

        $(#[$doc])*
        pub struct $name;

        #[cfg(target_arch = "x86_64")]
        impl Path for $name {
            type Lanes = $lanes;
            const NAME: &str = $label;

            fn available() -> bool {
                $(std::is_x86_feature_detected!($feature))&&+
            }

            fn enter<W: Task>(task: W) -> W::Output {
                assert!(Self::available(), "{} on a CPU without it", Self::NAME);
                // SAFETY: the features were just checked.
                unsafe { $module::compiled(task) }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
path!(
    /// AVX-512.
    Avx512, avx512, Pair<F64x8>, "avx512", ["avx512f", "avx512dq", "avx512vl", "avx2", "fma"]
);
#[cfg(target_arch = "x86_64")]
path!(
    /// AVX2 and FMA.
    Avx2, avx2, Pair<F64x4>, "avx2", ["avx2", "fma"]
);
#[cfg(all(target_arch = "x86_64", not(test)))]
path!(
    /// AVX-512 for models and numbers that are large themselves.
    Avx512Narrow, avx512_narrow, F64x8, "avx512", ["avx512f", "avx512dq", "avx512vl", "avx2", "fma"]
);
#[cfg(all(target_arch = "x86_64", not(test)))]
path!(
    /// AVX2 and FMA for numbers that are large themselves.
    Avx2Narrow, avx2_narrow, F64x4, "avx2", ["avx2", "fma"]
);
#[cfg(all(target_arch = "x86_64", not(test)))]
path!(
    /// One lane with FMA.
    ScalarFma, scalar_fma, f64, "scalar", ["avx2", "fma"]
);

/// Plain code for any CPU.
pub struct Portable;

impl Path for Portable {
    type Lanes = Pair<Pair<f64>>;
    const NAME: &str = "portable";

    fn available() -> bool {
        true
    }

    fn enter<W: Task>(task: W) -> W::Output {
        task.run()
    }
}

/// One lane of plain code.
pub struct PortableScalar;

impl Path for PortableScalar {
    type Lanes = f64;
    const NAME: &str = "scalar";

    fn available() -> bool {
        true
    }

    fn enter<W: Task>(task: W) -> W::Output {
        task.run()
    }
}

/// A path whose numbers carry a derivative.
pub struct Differentiating<P>(PhantomData<P>);

impl<P: Path> Path for Differentiating<P>
where
    P::Lanes: Real<Plain = P::Lanes, Lane = f64>,
{
    type Lanes = Dual<P::Lanes>;
    const NAME: &str = P::NAME;

    fn available() -> bool {
        P::available()
    }

    fn enter<W: Task>(task: W) -> W::Output {
        P::enter(task)
    }
}

/// The paths this CPU has, fastest first.
pub fn paths() -> Vec<SimdPath> {
    let mut found = Vec::new();
    #[cfg(target_arch = "x86_64")]
    {
        if Avx512::available() {
            found.push(SimdPath::Avx512);
        }
        if Avx2::available() {
            found.push(SimdPath::Avx2);
        }
    }
    found.extend([SimdPath::Portable, SimdPath::Scalar]);
    found
}

impl SimdPath {
    /// Name users see and type.
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "avx512",
            Self::Avx2 => "avx2",
            Self::Scalar => "scalar",
            Self::Portable => "portable",
        }
    }

    /// The path of a name, if this CPU has it.
    pub fn from_name(name: &str) -> Option<Self> {
        paths().into_iter().find(|path| path.name() == name)
    }
}

/// Lanes of base models that run side by side on a path with an explicit method; other rows may have fewer.
pub fn lanes_of_path(path: SimdPath) -> usize {
    match path {
        #[cfg(target_arch = "x86_64")]
        SimdPath::Avx512 => <Avx512 as Path>::Lanes::LANES,
        #[cfg(target_arch = "x86_64")]
        SimdPath::Avx2 => <Avx2 as Path>::Lanes::LANES,
        SimdPath::Portable => <Portable as Path>::Lanes::LANES,
        _ => 1,
    }
}

macro_rules! explicit {
    ($method:ident, $path:ty, $scalar:ty, $model:ty, $states:literal) => {
        match $method {
            MethodName::Bs3 => work::<$path, $scalar, $model, Bs3, $states>,
            MethodName::Tsit5 => work::<$path, $scalar, $model, Tsit5, $states>,
            MethodName::Dopri5 => work::<$path, $scalar, $model, Dopri5, $states>,
            _ => work::<$path, $scalar, $model, Dop853, $states>,
        }
    };
}

macro_rules! without_terms {
    ($job:ident, $method:ident, $path:ty, $scalar:ty) => {
        match $job.layout.base {
            Base::TwoInertia => explicit!($method, $path, $scalar, TwoInertia, 5),
            Base::OneInertia => explicit!($method, $path, $scalar, OneInertia, 4),
        }
    };
}

/// Terms come with two of the explicit methods: every further one is one more large kernel to build. Where registers are
/// too few for two vectors of them, two are no faster with many rows, and with few half of the lanes stay empty.
macro_rules! by_model {
    ($job:ident, $method:ident, $path:ty, $narrow:ty, $scalar:ty) => {
        match ($job.layout.base, $job.layout.terms.on.is_empty(), $method) {
            (_, true, _) => without_terms!($job, $method, $path, $scalar),
            (Base::TwoInertia, false, MethodName::Tsit5) => work::<$narrow, $scalar, Extended, Tsit5, 13>,
            (Base::TwoInertia, false, _) => work::<$narrow, $scalar, Extended, Dop853, 13>,
            (Base::OneInertia, false, MethodName::Tsit5) => work::<$narrow, $scalar, ExtendedRigid, Tsit5, 12>,
            (Base::OneInertia, false, _) => work::<$narrow, $scalar, ExtendedRigid, Dop853, 12>,
        }
    };
}

/// One method for every model.
macro_rules! by_model_only {
    ($job:ident, $path:ty, $scalar:ty, $method:ty) => {
        match ($job.layout.base, $job.layout.terms.on.is_empty()) {
            (Base::TwoInertia, true) => work::<$path, $scalar, TwoInertia, $method, 5>,
            (Base::OneInertia, true) => work::<$path, $scalar, OneInertia, $method, 4>,
            (Base::TwoInertia, false) => work::<$path, $scalar, Extended, $method, 13>,
            (Base::OneInertia, false) => work::<$path, $scalar, ExtendedRigid, $method, 12>,
        }
    };
}

/// The function that one thread of a job runs.
pub fn worker_of(job: &Job, method: MethodName) -> fn(&Shared) {
    match (job.directions.is_empty(), method) {
        (true, MethodName::Rodas5p) => stiff(job),
        (true, _) => values(job, method),
        (false, MethodName::Rodas5p) => derivatives::<Rodas5p>(job),
        (false, _) => derivatives::<Dop853>(job),
    }
}

fn values(job: &Job, method: MethodName) -> fn(&Shared) {
    match job.path {
        // The crate's unit tests never sweep: without the lanes they build in a fraction of the time.
        #[cfg(all(target_arch = "x86_64", not(test)))]
        SimdPath::Avx512 => by_model!(job, method, Avx512, Avx512Narrow, ScalarFma),
        #[cfg(all(target_arch = "x86_64", not(test)))]
        SimdPath::Avx2 => by_model!(job, method, Avx2, Avx2, ScalarFma),
        #[cfg(all(target_arch = "x86_64", not(test)))]
        SimdPath::Scalar if ScalarFma::available() => by_model!(job, method, ScalarFma, ScalarFma, ScalarFma),
        #[cfg(not(test))]
        SimdPath::Portable if job.layout.terms.on.is_empty() => without_terms!(job, method, Portable, PortableScalar),
        _ => by_model!(job, method, PortableScalar, PortableScalar, PortableScalar),
    }
}

fn stiff(job: &Job) -> fn(&Shared) {
    match job.path {
        #[cfg(all(target_arch = "x86_64", not(test)))]
        SimdPath::Avx512 => by_model_only!(job, Avx512Narrow, ScalarFma, Rodas5p),
        #[cfg(all(target_arch = "x86_64", not(test)))]
        SimdPath::Avx2 => by_model_only!(job, Avx2Narrow, ScalarFma, Rodas5p),
        #[cfg(all(target_arch = "x86_64", not(test)))]
        SimdPath::Scalar if ScalarFma::available() => by_model_only!(job, ScalarFma, ScalarFma, Rodas5p),
        _ => by_model_only!(job, PortableScalar, PortableScalar, Rodas5p),
    }
}

fn derivatives<T: Method>(job: &Job) -> fn(&Shared) {
    type One = Differentiating<PortableScalar>;
    match job.path {
        #[cfg(all(target_arch = "x86_64", not(test)))]
        SimdPath::Avx512 => by_model_only!(job, Differentiating<Avx512Narrow>, One, T),
        #[cfg(all(target_arch = "x86_64", not(test)))]
        SimdPath::Avx2 => by_model_only!(job, Differentiating<Avx2Narrow>, One, T),
        _ => by_model_only!(job, One, One, T),
    }
}
