//! A burn module's parameters as one list of numbers.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Gradients, Tensor, TensorData};

/// All parameters, in the order of the module's fields.
pub fn values(module: &impl Module) -> Vec<f32> {
    let mut getter = Getter { values: Vec::new() };
    module.visit(&mut getter);
    getter.values
}

/// The module with other parameters. What `values` has too few of stays; what it has too many of is ignored.
pub fn set<M: Module>(module: M, values: &[f32]) -> M {
    module.map(&mut Setter { rest: values })
}

/// The gradients of all parameters, zero where there is none.
pub fn gradients(module: &impl Module, gradients: &Gradients) -> Vec<f32> {
    let mut collector = Collector { gradients, values: Vec::new() };
    module.visit(&mut collector);
    collector.values
}

/// A tensor's numbers, row by row.
pub(crate) fn numbers<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().iter::<f32>().collect()
}

struct Getter {
    values: Vec<f32>,
}

impl ModuleVisitor for Getter {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.values.extend(numbers(param.val()));
    }
}

struct Setter<'a> {
    rest: &'a [f32],
}

impl ModuleMapper for Setter<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let shape = param.dims();
        let Some((own, rest)) = self.rest.split_at_checked(shape.iter().product()) else { return param };
        self.rest = rest;
        let device = param.val().device();
        Param::from_tensor(Tensor::from_data(TensorData::new(own.to_vec(), shape), &device))
    }
}

struct Collector<'a> {
    gradients: &'a Gradients,
    values: Vec<f32>,
}

impl ModuleVisitor for Collector<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        match param.val().grad(self.gradients) {
            Some(gradient) => self.values.extend(numbers(gradient)),
            None => self.values.resize(self.values.len() + param.dims().iter().product::<usize>(), 0.0),
        }
    }
}
