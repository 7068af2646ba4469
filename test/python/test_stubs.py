# SPDX-License-Identifier: BSD-3-Clause
"""cuboid_map: type stubs and documentation match the module."""
import ast
import inspect
import pathlib
import re

import cuboid_map
import pytest

STUBS = ast.parse((pathlib.Path(cuboid_map.__file__).parent / '_core.pyi').read_text())
CLASSES = {node.name: node for node in STUBS.body if isinstance(node, ast.ClassDef)}
FUNCTIONS = {node.name: node for node in STUBS.body if isinstance(node, ast.FunctionDef)}


def members(node):
    """Names of functions and attributes of a class in the stubs, without special ones."""
    for item in node.body:
        if isinstance(item, ast.FunctionDef):
            yield item.name, item
        elif isinstance(item, ast.AnnAssign):
            yield item.target.id, item


def is_property(node):
    return isinstance(node, ast.AnnAssign) or any(
        isinstance(decorator, ast.Name) and decorator.id == 'property' for decorator in node.decorator_list)


def arguments_of(function):
    """Parameters of a pybind11 function, from the first line of its documentation."""
    signature = re.match(r'\w+\((.*)\) ->', function.__doc__).group(1)
    # Types contain commas in brackets.
    while re.search(r'\[[^\[\]]*\]', signature):
        signature = re.sub(r'\[[^\[\]]*\]', '', signature)
    names = [part.split(':')[0].strip() for part in signature.split(', ') if ':' in part]
    return [name.lstrip('*') for name in names if name != 'self']


def arguments_in(stub):
    names = [argument.arg for argument in stub.args.args if argument.arg != 'self']
    return names


def expect_same(name, stub, function):
    assert function.__doc__.count('\n') > 1, f'{name} has no documentation'
    if stub.args.kwonlyargs or stub.args.kwarg:
        return
    assert arguments_of(function) == arguments_in(stub), name


@pytest.mark.parametrize('name', CLASSES)
def test_classes_have_the_members_of_their_stubs(name):
    cls = getattr(cuboid_map, name)
    public = {member for member in vars(cls) if not member.startswith('_')}
    declared = dict(members(CLASSES[name]))
    assert public == set(declared) - {'__init__'}
    assert cls.__doc__ or not public
    for member in public:
        value = inspect.getattr_static(cls, member)
        assert isinstance(value, property) == is_property(declared[member]), member
        if not isinstance(value, property):
            expect_same(member, declared[member], getattr(cls, member))
        else:
            assert value.__doc__, member


def test_a_number_may_be_given_where_one_is_the_default():
    num_checked = 0
    for name, stub in members(CLASSES['Map']):
        for argument in stub.args.args if isinstance(stub, ast.FunctionDef) else []:
            signature = getattr(cuboid_map.Map, name).__doc__ if argument.annotation else ''
            if re.search(rf'\b{argument.arg}: [^:=]*= [\d.]+[,)]', signature.split('\n')[0]):
                assert re.search(r"'(float|int)'", ast.dump(argument.annotation)), f'{name}: {argument.arg}'
                num_checked += 1
    assert num_checked > 5


def test_functions_are_those_of_the_stubs():
    functions = {name for name in cuboid_map.__all__ if inspect.isbuiltin(getattr(cuboid_map, name))}
    assert functions == set(FUNCTIONS)
    assert len(functions) > 1
    for name in functions:
        expect_same(name, FUNCTIONS[name], getattr(cuboid_map, name))


def test_the_configuration_is_that_of_the_stubs():
    (init,) = [item for name, item in members(CLASSES['Mapper']) if name == '__init__']
    declared = {argument.arg for argument in init.args.kwonlyargs}
    with pytest.raises(ValueError) as error:
        cuboid_map.Mapper(nothing=1)
    assert declared == set(re.search('known are: (.*)', str(error.value)).group(1).split(', '))
    documented = set(re.findall(r'(\w+)=', cuboid_map.Mapper.__doc__))
    assert declared == documented


def test_defaults_are_as_documented():
    texts = dict(re.findall(r"(\w+)=('\w+'|[\d.]+|inf)", cuboid_map.Mapper.__doc__))
    values = {key: float('inf') if text == 'inf' else ast.literal_eval(text) for key, text in texts.items()}
    assert len(values) > 10
    explicit, default = cuboid_map.Mapper(**values), cuboid_map.Mapper()
    assert explicit.resolution == default.resolution
    for mapper in (explicit, default):
        mapper.integrate([(1.0, 0.0, 0.0), (300.0, 0.0, 0.0)])
    points = [(1.0, 0.0, 0.0), (300.0, 0.0, 0.0), (0.5, 0.0, 0.0)]
    assert explicit.log_odds(points).tolist() == default.log_odds(points).tolist()
